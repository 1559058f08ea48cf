# Two commands: `make demo` and `make test`. Both build .venv by themselves. CI runs `make test` and `make slow`.

PYTHON ?= python3
BIN := .venv/bin
PYTEST := $(BIN)/python -m pytest --numprocesses auto --maxprocesses 8 --dist worksteal

.PHONY: demo test slow lint figures gallery validation fuzz promises blender soak lowest newest clean

demo: .venv/demo-ready
	$(BIN)/wavetank run obstacle-tank --seconds 4 --fps 30 --size 1280x720 --video --name demo --out out
	@echo
	@echo "Look at out/demo.mp4 and out/demo.png; the figures are in out/stats.json. Try next:"
	@echo "  $(BIN)/wavetank scenes"
	@echo "  $(BIN)/wavetank run drop --video"
	@echo "  $(BIN)/wavetank run double-dam-2d --video --set spacing=0.01"
	@echo "  $(BIN)/python examples/01_ten_lines.py"

# One worker a processor and one thread a worker; kernels that most tests share are compiled first.
test: export QD_CPU_MAX_NUM_THREADS = 1
test: lint
	$(BIN)/python tests/compile_kernels.py
	$(PYTEST) -m "not slow"

# The tests that take long (tests/slow.txt): whole studies, runs that are killed, other back ends, most examples and large scenes.
slow: export QD_CPU_MAX_NUM_THREADS = 1
slow: .venv/test-ready
	$(PYTEST) -m slow

lint: .venv/test-ready
	$(BIN)/ruff format --check src tests examples benchmarks
	$(BIN)/ruff check src tests examples benchmarks
	$(BIN)/mypy

# The pictures in docs, made anew.
figures: .venv/test-ready
	$(BIN)/python docs/figures.py

# A picture of every bundled scene: docs/gallery.md.
gallery: .venv/test-ready
	$(BIN)/python docs/figures.py gallery

# All cases of `wavetank validate` in full, with a picture of each: validation/README.md. Some minutes.
validation: .venv/test-ready
	$(BIN)/python docs/figures.py validation

# 20,000 mutations of all that comes from outside, each flood, each scene exact over 100 frames: an hour or two.
# What fails lies in tests/fuzz/found. make fuzz COUNT=1000 is shorter.
COUNT ?= 20000
fuzz: .venv/test-ready
	$(BIN)/python tests/fuzz/long.py --count $(COUNT)
	WAVETANK_FUZZ=long $(BIN)/python -m pytest -q tests/fuzz/test_attacks.py tests/page/test_floods.py tests/simulation/test_exact.py

# Every bundled scene over FRAMES frames: one thread, two threads, restored, killed and gone on, the same digest after each;
# and 100 times kill -9. An hour. make promises FRAMES=30 KILLS=5 is shorter.
FRAMES ?= 200
KILLS ?= 100
promises: .venv/test-ready
	$(BIN)/python tests/promises.py scenes --frames $(FRAMES)
	$(BIN)/python tests/promises.py kills --count $(KILLS)

# Blender opens a run by the add-on in examples/blender, in an environment of its own; says so where it cannot be had.
blender: .venv/test-ready
	$(BIN)/python tests/blender.py || test $$? -eq 77

# An hour of playing, switching scenes, coming and going, exporting: memory and speed over time. make soak MINUTES=5 is shorter.
MINUTES ?= 60
soak: .venv/test-ready
	$(BIN)/python tests/fuzz/soak.py --minutes $(MINUTES)

# The tests that lean on packages, with the lowest and with the newest versions that are allowed.
lowest newest: .venv/test-ready
	$(BIN)/python tests/dependencies.py $@

clean:
	rm -rf .venv .venv-blender .venv-lowest .venv-newest out

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "wavetank needs Python 3.11 or newer; this is $$($(PYTHON) --version). Use make PYTHON=python3.12"; exit 1; }
	$(PYTHON) -m venv .venv

.venv/demo-ready: pyproject.toml constraints.txt | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@touch $@

.venv/test-ready: pyproject.toml constraints.txt | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@ .venv/demo-ready
