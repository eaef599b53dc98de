# On a fresh machine with Python >= 3.11 and make: `make run`, `make test`.
PYTHON ?= $(shell for p in python3.11 python3; do \
  $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
VENV ?= .venv
BIN := $(abspath $(VENV))/bin
# Of what is installed only what is imported is compiled, and kept.
export PYTHONDONTWRITEBYTECODE :=
PACKAGE := $(VENV)/.installed
RUNTIME := $(VENV)/.compiled
IMPORTED := $(VENV)/.imported
TOOLS := $(VENV)/.installed-tools
DOCTOOLS := $(VENV)/.installed-doctools
# Tests that share what they assemble, compile and run stay with one worker (tests/conftest.py).
PYTEST := $(BIN)/pytest -n 2 --dist loadfile

.PHONY: run test lint unit core slow docs cases wheel coverage mutation bench clean

run: $(RUNTIME)  ## the main case: its error, its run time, its plot
	mkdir -p results
	$(BIN)/surfacechem run exothermic -o results/exothermic.nc
	$(BIN)/surfacechem plot results/exothermic.nc -o results/exothermic.png

# The documentation comes after `lint`, and finds the code of cases that the tests beside have made by then.
test:  ## everything, side by side; the tests run every case, and the wheel by itself
	$(MAKE) --jobs=2 --output-sync=target lint unit docs

lint: $(TOOLS)  ## style, types and which room imports which
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

unit: $(RUNTIME) $(TOOLS)  ## the tests, without the slow ones
	$(PYTEST)

core: $(RUNTIME) $(TOOLS)  ## of these the tests of assembly, laws, mechanisms, stepper and exact solutions
	$(PYTEST) -m "not slow and not around"

slow: $(RUNTIME) $(TOOLS)  ## the slow tests
	$(PYTEST) -m slow

docs: $(RUNTIME) $(DOCTOOLS)  ## the documentation, notebooks executed, warnings are errors
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

# A case that physics stops, by design, ends with status 3.
cases: $(RUNTIME)  ## every case in cases/
	mkdir -p results
	for case in $$(ls cases | sed -n 's/\.yaml$$//p'); do \
	  $(BIN)/surfacechem run $$case -o results/$$case.nc || [ $$? -eq 3 ] || exit 1; done

wheel: $(TOOLS)  ## the source distribution and the wheel for this platform, which carries the compiled stepper
	rm -rf dist
	SURFACECHEM_COMPILE=1 $(BIN)/python -m build --no-isolation

coverage: $(TOOLS)  ## the lines that the tests reach; fails under 95 %
	rm -rf build/coverage
	mkdir -p build/coverage
	$(BIN)/coverage run -m pytest -n 2 --dist loadfile
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report

mutation: $(TOOLS)  ## each sign of balances, assembly and laws is changed, and a test has to fail
	$(BIN)/pip install --quiet --group mutation
	$(BIN)/python tests/mutation.py

bench: $(TOOLS)  ## time against error of every solver beside what was kept in benchmarks/results, and where time goes
	$(BIN)/python benchmarks/steppers.py
	$(BIN)/python benchmarks/startup.py
	$(BIN)/python benchmarks/scripts.py
	$(BIN)/python benchmarks/accuracy.py
	$(BIN)/python benchmarks/surfaces.py

clean:  ## all that make has made
	rm -rf $(VENV) build dist results site

$(VENV)/bin/python:
	$(or $(PYTHON),$(error No Python >= 3.11 found. Name one: make PYTHON=/path/to/python3.11)) -m venv $(VENV)

# An old pip takes three times as long to find which versions go together.
$(PACKAGE): pyproject.toml | $(VENV)/bin/python
	$(BIN)/pip install --quiet --no-compile --upgrade pip
	$(BIN)/pip install --quiet --no-compile --editable .
	touch $@

$(RUNTIME): $(PACKAGE)
	$(BIN)/python -m surfacechem.solve
	$(BIN)/surfacechem run exothermic -q -o $(VENV)/exothermic.nc
	touch $@

# Every module is imported with nothing but what the package declares to need.
$(IMPORTED): $(PACKAGE)
	$(BIN)/python -c "from pkgutil import walk_packages as w; [__import__(m.name) for m in w(['surfacechem'], 'surfacechem.') if '__main__' not in m.name]"
	touch $@

$(TOOLS): $(IMPORTED)
	$(BIN)/pip install --quiet --no-compile --group test
	touch $@

# After the other tools, since tests begin as soon as those are there.
$(DOCTOOLS): $(TOOLS)
	$(BIN)/pip install --quiet --no-compile --group docs
	touch $@
