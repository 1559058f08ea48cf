"""How many triangles a mesh file will make, read from its header before they are built.

STL (binary): a count after 80 bytes, 50 bytes a triangle. PLY: lines "element NAME COUNT" of the header. OBJ: lines
that begin with f, and their corners. GLB: the JSON chunk names meshes, accessors with counts, and nodes that place
meshes, one mesh as often as one likes (glTF 2.0, 3.5 and 3.6).
"""

import re
from pathlib import Path
from typing import Any

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import one_line, open_regular, parse_json
from wavetank.foundation.memory import check_free, in_words

MOST_FACES = 3_000_000  # before duplicates are dropped
MOST_NUMBERS = 40_000_000  # in all accessors
MOST_PLACED = 2_000  # meshes in a scene, with repetitions
DEEPEST = 64  # nodes within nodes
LARGEST_FILE = 500_000_000  # bytes
TIMES = 8  # memory that reading takes, over the size of a file of text


def check_file(path: Path) -> None:
    """Raise `ValueError` for a file that cannot be read, is too large, or makes more triangles than are allowed."""
    try:
        with open_regular(path, LARGEST_FILE, "mesh file") as file:
            kind = path.suffix.lower()
            size = file.seek(0, 2)
            check_free(TIMES * size, f"{path}: reading it")
            file.seek(0)
            _check_mark(kind, file.read(1024), size)
            file.seek(0)
            faces, why = _CHECKS[kind](file) if kind in _CHECKS else (0, "")
    except WavetankError as error:
        raise ValueError(f"{error} Simplify the mesh.") from None
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise ValueError(f"{path}: this mesh cannot be read: {one_line(error)}.") from None
    if faces > MOST_FACES:
        raise ValueError(
            f"{path} has {faces:,} triangles{why}; at most {MOST_FACES:,} are read: simplify it, details below half a "
            "spacing are lost anyway."
        )


def _check_mark(kind: str, head: bytes, size: int) -> None:
    """Raise `ValueError` where a file does not begin as its kind does, before all of it is read as text."""
    claimed = int.from_bytes(head[80:84], "little")
    is_binary = kind == ".stl" and size == 84 + 50 * claimed
    if kind == ".stl" and not is_binary and b"solid" not in head:
        raise ValueError(
            f"it does not begin as a .stl file does; {size:,} bytes are not those of {claimed:,} triangles"
        )
    marks = {".ply": head.startswith(b"ply"), ".glb": head.startswith(b"glTF"), ".stl": is_binary or b"solid" in head}
    if not marks.get(kind, True) or (kind in (".stl", ".obj") and not is_binary and b"\0" in head):
        raise ValueError(f"it does not begin as a {kind} file does")


def _stl(file: Any) -> tuple[int, str]:
    head = file.read(84)
    size = file.seek(0, 2)
    claimed = int.from_bytes(head[80:84], "little")
    if head[:5] == b"solid" and size != 84 + 50 * claimed:
        file.seek(0)
        return sum(block.count(b"facet normal") for block in _blocks(file)), ""
    return max(claimed, 0) if size >= 84 else 0, ""


def _ply(file: Any) -> tuple[int, str]:
    head = file.read(65536).partition(b"end_header")[0]
    counts = {name: int(number) for name, number in re.findall(rb"element\s+(\w+)\s+(\d{1,18})\b", head)}
    if re.search(rb"element\s+\w+\s+\d{19}", head):
        return 10**19, ""
    return max([*counts.values(), 0]) if counts.get(b"vertex", 0) > 3 * MOST_FACES else counts.get(b"face", 0), ""


def _obj(file: Any) -> tuple[int, str]:
    corners = lines = 0
    for block in _blocks(file):
        lines += block.count(b"\nf ") + block.count(b"\nf\t") + block.startswith(b"f ")
        corners += block.count(b"\nv ")
    return max(lines, corners // 3), ""


def _glb(file: Any) -> tuple[int, str]:
    head = file.read(20)
    if head[:4] != b"glTF":
        return 0, ""
    length = int.from_bytes(head[12:16], "little")
    if length > 64_000_000:
        raise WavetankError(f"its description has {in_words(length)}.")
    table = parse_json(file.read(length).decode("utf-8", "replace"), "its description")
    accessors = [int(entry["count"]) for entry in table.get("accessors", [])]
    if any(count < 0 for count in accessors) or sum(accessors) > MOST_NUMBERS:
        raise WavetankError(f"it has {sum(map(abs, accessors)):,} numbers; at most {MOST_NUMBERS:,} are read.")
    faces = []
    for mesh in table.get("meshes", []):
        parts = mesh.get("primitives", [])
        places = [part.get("indices", part.get("attributes", {}).get("POSITION")) for part in parts]
        faces.append(sum(accessors[place] // 3 for place in places if place is not None))
    nodes = table.get("nodes", [])
    placed = _placed(nodes, table)
    if sum(placed.values()) > MOST_PLACED:
        raise WavetankError(f"it places {sum(placed.values()):,} meshes; at most {MOST_PLACED:,} are read.")
    total = sum(faces[mesh] * times for mesh, times in placed.items())
    return total, f" in {sum(placed.values()):,} places"


def _placed(nodes: list[Any], table: dict[str, Any]) -> dict[int, int]:
    """Return how often each mesh is placed, counted by walking over the tree of nodes."""
    placed: dict[int, int] = {}
    children = {child for node in nodes for child in node.get("children", [])}
    scenes = [root for scene in table.get("scenes", []) for root in scene.get("nodes", [])]
    waiting = [(root, 0) for root in (scenes or [k for k in range(len(nodes)) if k not in children])]
    steps = 0
    while waiting:
        number, depth = waiting.pop()
        steps += 1
        if steps > 50 * MOST_PLACED or depth > DEEPEST:
            raise WavetankError("its nodes are nested too deep, in circles, or too many.")
        node = nodes[number]
        if "mesh" in node:
            placed[int(node["mesh"])] = placed.get(int(node["mesh"]), 0) + 1
        waiting += [(child, depth + 1) for child in node.get("children", [])]
    return placed


def _blocks(file: Any, size: int = 1 << 22) -> Any:
    while block := file.read(size):
        yield block


_CHECKS = {".stl": _stl, ".ply": _ply, ".obj": _obj, ".glb": _glb}
