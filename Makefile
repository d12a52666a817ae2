# Two targets do everything, set-up included, on a machine with Python 3.11+, make and a package index.
#   make reproduce   run the main job and say where its results lie; it installs only what that needs
#   make test        lint, types, tests
# And one more builds the site into docs/_build/html, its examples run:
#   make docs
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/ready
# Holds what `make reproduce` needs; an environment that is ready holds it too.
LIGHT  := $(VENV)/ready-to-reproduce

.PHONY: reproduce test test-pure test-slow lint types tests docs bench bench-kernels history fuzz stale refresh release-check test-matrix pins clean

reproduce: $(LIGHT)
	$(BIN)/cembench reproduce

test: lint types tests

# A minute or two: what needs no process, for changes of kernels, meshes and algorithms.
test-pure: $(READY)
	$(BIN)/python -m pytest -m "pure and not slow" -n auto --dist loadfile -q

test-slow: $(READY)
	$(BIN)/python -m pytest -m slow

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

# Bytecode is kept even where the system's default is not to: every interpreter that a test starts compiles everything otherwise.
tests: $(READY)
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -m "not slow" -n auto --dist loadfile --no-loadscope-reorder --durations=25

docs: $(READY)
	$(BIN)/python -m sphinx -b html -W --keep-going docs docs/_build/html

bench: $(READY)
	$(BIN)/python -m benchmarks limit 276000 1690000

# Measures what the kept history lacks, about 40 s a commit, and writes its page. HISTORY="--meshes ../shared/meshes" and the like.
history: $(READY)
	$(BIN)/python -m benchmarks.kept_history.measure $(HISTORY)

bench-kernels: $(READY)
	$(BIN)/python -m pytest tests/benchmarks/test_kernels.py --benchmark-enable --benchmark-autosave

# Fails while a kept report or a table of a page is older than the code it depends on; reports/README.md lists them.
stale: $(READY)
	$(BIN)/python -m benchmarks stale --check

# What makes them again, and how long that took.
refresh: $(READY)
	$(BIN)/python -m benchmarks stale --refresh

# Wheel and sdist, built and tried in an environment of their own.
release-check: $(READY)
	$(BIN)/python .ci/release_check.py

# The tests under each Python that is installed here, and under the lowest versions of all libraries.
test-matrix: $(READY)
	$(BIN)/python .ci/test_matrix.py

# What the kept reports were measured with, each file with its hash; `pip install --require-hashes -r` takes it.
pins: $(READY)
	UV_CUSTOM_COMPILE_COMMAND="make pins" $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
	  --extra fetch --extra report --extra standins --constraint requirements/kept.in pyproject.toml --output-file requirements/kept.txt

# Hours where nothing limits it; goes on where it was ended. FUZZ="--seconds 600 --seed 2" and the like.
fuzz: $(READY)
	$(BIN)/python -m tests.campaign $(FUZZ)

# Stale when the requirements change; the environment's own Python must still start.
define environment
	@$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11))" || \
	  { echo "cembench needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>&1). Try: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	@test -x $(BIN)/python && $(BIN)/python -c "" 2>/dev/null || { rm -rf $(VENV); $(PYTHON) -m venv $(VENV); }
endef
INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable

$(READY): pyproject.toml
	$(environment)
	$(INSTALL) ".[all,test]"
	@touch $(LIGHT) $@

$(LIGHT): pyproject.toml
	$(environment)
	@test $(READY) -nt $< || { set -x; $(INSTALL) ".[fetch,report,standins]"; }
	@touch $@

clean:
	rm -rf $(VENV) docs/_build docs/api docs/gallery docs/cli.md docs/history.* build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
