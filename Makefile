# Everything goes through .venv at the root; a bare Debian or Ubuntu machine with Python 3.11 or newer will do.
SHELL := /bin/bash
PYTHON ?= python3
BIN := .venv/bin
SETUP := pyproject.toml requirements.lock tools/setup.sh tools/apt_install.sh
# The pyright wrapper would ask the network for its newest version at each run.
.NOTPARALLEL:
export PYRIGHT_PYTHON_IGNORE_WARNINGS := 1

.DEFAULT_GOAL := help
.PHONY: help demo test test-slow lint types unit browser llvm format docs lock clean

help: ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-10s %s\n", $$1, $$2}' Makefile

demo: .venv/.runtime.stamp llvm ## set up, then compare all methods on the demo scene: table, plot and web page in out/demo
	$(BIN)/mpcam compare --demo --output out/demo

test: lint types unit ## all the checks: ruff, pyright, pytest

lint: .venv/.test.stamp ## ruff: rules and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: .venv/.test.stamp ## pyright
	$(BIN)/pyright

unit: .venv/.test.stamp llvm browser ## pytest, without the slow tests
	$(BIN)/pytest -n 2 -m "not slow"

test-slow: .venv/.test.stamp llvm browser ## pytest, the slow tests alone
	$(BIN)/pytest -n 2 -m slow

format: .venv/.test.stamp ## let ruff mend what it can
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: .venv/.docs.stamp llvm ## the documentation, in docs/_build/html
	$(BIN)/sphinx-build -q -W --keep-going docs docs/_build/html

lock: ## resolve the newest allowed versions anew into requirements.lock
	rm -rf build/lock && $(PYTHON) -m venv build/lock
	build/lock/bin/python -m pip install -q hatchling ".[test,docs]"
	build/lock/bin/python -m pip freeze --exclude mpcam --exclude pip --exclude setuptools | LC_ALL=C sort -f > build/requirements.lock
	mv build/requirements.lock requirements.lock && rm -rf build/lock

clean: ## remove what was built or rendered; .venv stays
	rm -rf build dist out docs/_build .pytest_cache .ruff_cache .hypothesis
	find mpcam kernels tests experiments docs tools -name __pycache__ -prune -exec rm -rf {} +

llvm: | .venv/.runtime.stamp
	@tools/ensure_llvm.sh

browser:
	@command -v chromium >/dev/null \
		|| tools/apt_install.sh "the tests of the report page need chromium" "chromium|chromium-browser" fonts-liberation

.venv/.runtime.stamp: $(SETUP)
	PYTHON=$(PYTHON) tools/setup.sh
	@touch $@

.venv/.test.stamp: $(SETUP)
	PYTHON=$(PYTHON) tools/setup.sh test
	@touch $@ .venv/.runtime.stamp

.venv/.docs.stamp: $(SETUP)
	PYTHON=$(PYTHON) tools/setup.sh docs
	@touch $@ .venv/.runtime.stamp
