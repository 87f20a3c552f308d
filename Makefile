# Two commands set up and do everything: `make run` (the main job) and `make test` (the tests).
# They need Python 3.11 or newer, git and make, and fetch nothing but packages from the package index.

VENV := .venv
BIN := $(VENV)/bin
# The first Python of 3.11 or newer that can make an environment.
PYTHON ?= $(shell for p in python3.11 python3.12 python3.13 python3 python; do \
	$$p -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && echo $$p && break; done)
STAMPS := $(VENV)/stamps
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet install --progress-bar off --constraint constraints.txt
INPUTS := pyproject.toml constraints.txt
SCENARIO ?= C1

.PHONY: help run test coverage bench lint types layers docs clean

help:  ## list these targets
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

run: $(STAMPS)/run  ## set up, then run the main job: a Franka among moving balls (SCENARIO=... for another)
	$(BIN)/cdfctl run $(SCENARIO)

test: $(STAMPS)/test  ## set up, then run the tests on all cores
	$(BIN)/python -m pytest --numprocesses=logical --dist=loadgroup $(ARGS)

coverage: $(STAMPS)/test  ## the same with coverage of lines and branches, which takes a quarter longer
	$(BIN)/python -m pytest --numprocesses=logical --dist=loadgroup --cov --cov-report=term $(ARGS)

bench: $(STAMPS)/test  ## time the control step and what it grows with, beside the goals
	$(BIN)/python tests/benchmarks $(ARGS)

lint: $(STAMPS)/lint  ## style and format of the code
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMPS)/lint  ## mypy, strict
	$(BIN)/mypy

layers: $(STAMPS)/lint  ## imports go down only
	$(BIN)/lint-imports

docs: $(STAMPS)/docs  ## the documentation, warnings as errors, into docs/_build/html
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html

clean:  ## remove the environment and everything built
	rm -rf $(VENV) build dist docs/_build docs/_figures .coverage .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks

$(STAMPS)/venv:
	@test -n "$(PYTHON)" || { echo "cdfctl needs Python 3.11 or newer with its venv module; set PYTHON=/path/to/python" >&2; exit 3; }
	$(PYTHON) -m venv --clear $(VENV)
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/run: $(STAMPS)/venv $(INPUTS)
	@echo 'Installing cdfctl and what it needs into $(VENV) (one or two minutes, once)'
	@$(PIP) --editable .
	@touch $@

$(STAMPS)/test: $(STAMPS)/venv $(INPUTS)
	@echo 'Installing cdfctl with its tests and torch into $(VENV) (some minutes, once)'
	@$(PIP) --editable '.[test,torch]'
	@touch $@ $(STAMPS)/run

$(STAMPS)/lint: $(STAMPS)/venv $(INPUTS)
	@echo 'Installing the lint tools into $(VENV)'
	@$(PIP) --editable '.[lint]'
	@touch $@

$(STAMPS)/docs: $(STAMPS)/venv $(INPUTS)
	@echo 'Installing the docs tools into $(VENV)'
	@$(PIP) --editable '.[docs]'
	@touch $@
