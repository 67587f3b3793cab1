# Every target does its own set-up: the first one run on a fresh machine creates .venv.
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3 python; do \
	command -v $$p >/dev/null 2>&1 && $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	&& { command -v $$p; break; }; done)
BIN := .venv/bin

.PHONY: install demo test test-slow lint docs bench clean
.DEFAULT_GOAL := install

install: .venv/installed

.venv/installed: pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "bristle needs Python 3.11 or newer and found none; install it or set PYTHON=/path/to/python3.11" >&2; exit 2; }
	@"$(PYTHON)" -c 'import venv, ensurepip' 2>/dev/null || { echo "$(PYTHON) has no venv module; install it (Debian: apt-get install python3-venv) or set PYTHON=" >&2; exit 2; }
	"$(PYTHON)" -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	@touch $@

demo: install
	$(BIN)/bristle demo --out demo-output $(if $(KEEP),--keep)

# Bytecode is written even where the environment forbids it: the tests start many processes.
PYTEST := PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

# The tests that take seconds at most. They take less than ten minutes on two cores.
test: install
	$(PYTEST)

# The end-to-end tests that `make test` leaves out. CI runs both.
test-slow: install
	$(PYTEST) -m 'slow and not long'

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: install
	rm -rf build/docs
	PYTHONPATH=. $(BIN)/python -m sphinx --keep-going --nitpicky --fail-on-warning --quiet docs build/docs
	$(BIN)/python -m tools.check_site build/docs

bench: install
	$(BIN)/python -m benchmarks.fit
	$(BIN)/python -m benchmarks.pass
	$(BIN)/python -m benchmarks.simulator
	$(BIN)/python -m benchmarks.catalogue
	$(BIN)/python -m benchmarks.link
	$(BIN)/python -m benchmarks.monitor
	$(BIN)/python -m benchmarks.detector
	$(BIN)/python -m benchmarks.fleet

clean:
	rm -rf .venv build dist demo-output .mypy_cache .pytest_cache .ruff_cache .hypothesis
