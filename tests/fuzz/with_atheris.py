"""The parsers, driven by what code an input reaches: optional, needs `pip install atheris` (Linux, CPython).

    python tests/fuzz/with_atheris.py scene  -max_total_time=60 corpus/
    python tests/fuzz/with_atheris.py array -max_total_time=60

`scene`, `json`, `array`, `mesh`: bytes go to the door as they come. Anything but `WavetankError` is a crash.
"""

import io
import os
import sys

import atheris

os.environ["WAVETANK_STRICT_INPUT"] = "1"
with atheris.instrument_imports(include=["wavetank.foundation", "wavetank.scene", "wavetank.solids.meshes", "tomllib"]):
    import wavetank as wt
    from wavetank.foundation import input_limits
    from wavetank.solids.meshes import counted


def scene(data: bytes) -> None:
    wt.Scene.from_text(data.decode("utf-8", "replace"), "scene", files=False)


def plain(data: bytes) -> None:
    input_limits.parse_json(data.decode("utf-8", "replace"), "text")


def array(data: bytes) -> None:
    input_limits.read_array(io.BytesIO(data), len(data), "file", "array")


def archive(data: bytes) -> None:
    input_limits.unpack_arrays(io.BytesIO(data), len(data), "file")


def mesh(data: bytes) -> None:
    for check in counted._CHECKS.values():
        try:
            check(io.BytesIO(data))
        except (KeyError, TypeError, ValueError, IndexError, AttributeError):  # which `check_file` tells
            continue


INPUTS = {"scene": scene, "json": plain, "array": array, "archive": archive, "mesh": mesh}


def main() -> None:
    attempt = INPUTS[sys.argv.pop(1)]

    def once(data: bytes) -> None:
        try:
            attempt(data)
        except wt.WavetankError as error:
            assert "\n" not in str(error)

    atheris.Setup(sys.argv, once)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
