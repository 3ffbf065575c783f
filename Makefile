# make setup | wheel | demo | test | test-all | gate | bench | stress | studies | gallery | docs | notebooks | clean
PYTHON ?= python3
WORKERS ?= 2

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
BENCH_STAMP := $(VENV)/.bench-installed
DOCS_STAMP := $(VENV)/.docs-installed
TESTS_STAMP := $(VENV)/.tests-compiled
SITE := site
DEMO := demo
STRESS := .stress

# uv takes a tenth of pip's time; where it cannot be had, or does not find the packages, pip does it.
# $(1) are extras; a comma would end the argument of `call`.
comma := ,
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
install = { $(PIP) uv && $(BIN)/uv pip install --quiet --python $(BIN)/python --editable '.[$(1)]'; } 2>/dev/null \
	    || $(PIP) --editable '.[$(1)]'

.DEFAULT_GOAL := help
.PHONY: help setup kernels bytecode wheel demo test lint types contracts unit pytest test-all gate bench stress studies gallery docs notebooks clean
MAKEFLAGS += --no-print-directory
# What is imported is compiled once, not by each of the programs that the tests start, even where this is set:
# without its bytecode scipy alone takes three times as long to load.
unexport PYTHONDONTWRITEBYTECODE

help:
	@echo "make demo     the bifurcation diagram of Fig. 5, from one simulated orbit, in $(DEMO)/"
	@echo "make test     lint, types, import contracts, tests"
	@echo "make test-all the same with the tests that take long"
	@echo "make gate     whether anything got slower: a minute, against a yardstick of the machine"
	@echo "make bench    run times, cost at scale and of scenes, run time against error beside others"
	@echo "make stress   random cases against 50 digits, to docs/stress.md (an hour or more)"
	@echo "make studies  every bundled study from the shell, each with a time limit, to docs/studies.md"
	@echo "make gallery  the figures of docs/gallery"
	@echo "make docs     the documentation as a site, in $(SITE)/; a warning or a broken link fails it"
	@echo "make notebooks  the notebooks of docs/tutorial, executed anew in place"
	@echo "make setup    a virtual environment in $(VENV)/, and all kernels compiled"
	@echo "make wheel    a wheel in dist/ with compiled kernels, for this Python, numba and platform"
	@echo "make clean    removes what make and the tests wrote, and keeps $(VENV)/"

setup: $(STAMP) kernels

# What is compiled already is not compiled again: a second when there is nothing to do.
kernels: $(STAMP)
	@echo "== kernels"
	@$(BIN)/contfric doctor --compile --workers $(WORKERS)

# Without isolation: the kernels in it are for the numba and llvmlite that they are compiled with.
wheel: $(STAMP)
	@echo "== wheel"
	@$(BIN)/python -m build --wheel --no-isolation --outdir dist

$(STAMP): pyproject.toml
	@echo "== setup: $(VENV)"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(call install,dev)
	@touch $@

$(BENCH_STAMP): $(STAMP)
	@echo "== setup: peers for the benchmarks"
	@$(call install,dev$(comma)bench) \
	    || echo "not all peers can be installed here: those that are missing are left out"
	@touch $@

$(DOCS_STAMP): $(STAMP)
	@echo "== setup: mkdocs"
	@$(call install,dev$(comma)docs)
	@touch $@

demo: $(STAMP)
	@echo "== demo: contfric run fig05 --out $(DEMO)"
	@$(BIN)/contfric run fig05 --out $(DEMO) --force
	@echo "Figures:"; find $(DEMO) -type f \( -name '*.png' -o -name '*.svg' -o -name '*.pdf' \) | sort | sed 's/^/  /'
	@echo "Tables and restart data:"; find $(DEMO) -type f \( -name '*.csv' -o -name '*.json' -o -name '*.npz' \) | sort | sed 's/^/  /'

# What can be done at once, then pytest: its closing line is the last line.
test: $(STAMP)
	@$(MAKE) -j$(WORKERS) --output-sync=target types lint contracts kernels bytecode
	@$(MAKE) pytest

lint: $(STAMP)
	@echo "== ruff check"
	@$(BIN)/ruff check --quiet .
	@echo "== ruff format --check"
	@$(BIN)/ruff format --check --quiet .

types: $(STAMP)
	@echo "== mypy"
	@$(BIN)/mypy --no-error-summary

contracts: $(STAMP)
	@echo "== lint-imports"
	@$(BIN)/lint-imports

# pytest compiles each file of tests when it is first read, and each of its workers would: half a minute, which
# one processor has while the other reads types.
bytecode: $(TESTS_STAMP)

$(TESTS_STAMP): $(STAMP) $(shell find tests -name '*.py') | kernels
	@echo "== bytecode of tests"
	@$(BIN)/python -m pytest --collect-only -qq > /dev/null || true # what is wrong pytest itself says
	@touch $@

unit: $(STAMP) kernels
	@$(MAKE) pytest

pytest: $(STAMP)
	@echo "== pytest"
	@# a file by one worker: its kernels are loaded and its fixtures computed once, a tenth of the time
	@$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile -m "not slow"

# With the tests that take long and tell little more.
test-all: $(STAMP)
	@$(MAKE) lint
	@$(MAKE) types
	@$(MAKE) contracts
	@echo "== pytest, slow ones too"
	@$(BIN)/python -m pytest -n $(WORKERS)

# A minute; not in CI, where machines are noisy.
gate: $(STAMP)
	@echo "== gate"
	@$(BIN)/python benchmarks/gate.py

# The peers are not needed by anything else: where one has no wheel, the page does without.
bench: $(BENCH_STAMP)
	@echo "== bench"
	@$(BIN)/python -m pytest benchmarks -o python_files='bench_*.py' --benchmark-only
	@$(BIN)/python benchmarks/table.py
	@$(BIN)/python benchmarks/error.py
	@$(BIN)/python benchmarks/scale.py
	@$(BIN)/python benchmarks/scenes.py
	@$(BIN)/python benchmarks/curves.py
	@$(BIN)/python benchmarks/lyapunov.py
	@$(BIN)/python benchmarks/lyapunov_models.py
	@$(BIN)/python benchmarks/integrated.py
	@$(BIN)/python benchmarks/states.py
	@$(BIN)/python benchmarks/everyday.py
	@$(BIN)/python benchmarks/contacts.py
	@$(BIN)/python benchmarks/six_segments.py
	@$(BIN)/python benchmarks/first_orbit.py
	@$(BIN)/python benchmarks/auto.py
	@$(BIN)/python benchmarks/compile_seconds.py

# An hour or more; sequences and restarts go on where they were interrupted.
stress: $(STAMP)
	@echo "== stress"
	@mkdir -p $(STRESS)
	@$(BIN)/python benchmarks/stress/sequences.py --count 100000 --seed 1 --workers $(WORKERS) --out $(STRESS)/sequences.json
	@$(BIN)/python benchmarks/stress/segments.py --count 10000 --seed 5 --out $(STRESS)/segments.json
	@$(BIN)/python benchmarks/stress/orbits.py --count 400 --seed 3 --out $(STRESS)/orbits.json
	@$(BIN)/python benchmarks/stress/events.py --count 400 --seed 2 --out $(STRESS)/events.json
	@$(BIN)/python benchmarks/stress/continuation.py --count 300 --seed 2 --out $(STRESS)/continuation.json
	@$(BIN)/python benchmarks/stress/restarts.py --count 3000 --seed 1 --workers $(WORKERS) --out $(STRESS)/restarts.json
	@$(BIN)/python benchmarks/stress/models.py --count 300 --seed 8 --workers $(WORKERS) --out $(STRESS)/models.json
	@$(BIN)/python benchmarks/stress/write_page.py $(STRESS)/*.json --out docs/stress.md

# A study that does not end within the limit, or ends with an error, fails this.
studies: $(STAMP)
	@echo "== studies"
	@$(BIN)/python benchmarks/studies.py

gallery: $(STAMP)
	@echo "== gallery"
	@set -e; found=no; for script in docs/gallery/*.py; do \
	    test -f "$$script" || continue; found=yes; echo "$$script"; $(BIN)/python "$$script"; \
	done; test $$found = yes || echo "no docs/gallery/*.py yet"

# Without --quiet, with which mkdocs does not count its warnings. The variable silences the theme's
# advertisement of its successor.
docs: $(DOCS_STAMP)
	@echo "== docs"
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --site-dir $(SITE)
	@echo "$(SITE)/index.html (its search needs a server: python3 -m http.server -d $(SITE))"

notebooks: $(STAMP)
	@echo "== notebooks"
	@$(BIN)/python docs/_site/notebooks.py

clean:
	@rm -rf build dist $(DEMO) $(SITE) .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks .import_linter_cache
	@find contfric tests benchmarks docs -name __pycache__ -type d -prune -exec rm -rf {} +
