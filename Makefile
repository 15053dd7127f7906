# make study   install into .venv if need be, then run the main job
# make test    the same, then the quick checks: ruff, mypy, pytest
# make help    every target

PYTHON ?= python3
JOBS ?= 2

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

# Tests run in parallel processes; threads of BLAS and OpenMP on top would fight for the cores.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
# Stealing leaves neighbours together, so that what a file sets up is set up once.
PYTEST := $(ONE_THREAD) $(BIN)/python -m pytest -n $(JOBS) --dist worksteal

.DEFAULT_GOAL := help
.PHONY: help venv study lint test test-all test-slow platforms mutants bench reports notebooks clean

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  \1\t\2/p' Makefile | expand -t 14

venv: $(STAMP) ## create .venv with the tested versions of everything

$(STAMP): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --disable-pip-version-check --progress-bar off --quiet \
		-c constraints.txt -e '.[all,dev]'
	touch $@

study: $(STAMP) ## the main job: strategies compared, a real recording diagnosed; writes build/study
	$(BIN)/pikanid study

lint: $(STAMP) ## ruff and mypy
	$(BIN)/python -m ruff check .
	$(BIN)/python -m mypy

test: lint ## lint, then the quick tests (minutes)
	$(PYTEST)

test-all: lint ## lint, then all tests, the slow ones too
	$(PYTEST) -m ""

mutants: $(STAMP) ## wrong lines that the tests see: mutmut on a sample, to reports/mutants.md
	mkdir -p reports
	$(BIN)/python benchmarks/mutants.py run $(JOBS)
	$(BIN)/python benchmarks/mutants.py again $(JOBS)
	$(BIN)/python benchmarks/mutants.py report reports

# The number of commits decides: the same commit runs the same part, the next one the next.
SLOW_PARTS ?= 8
SLOW_PART ?= $(shell echo $$(( $$(git rev-list --count HEAD 2>/dev/null || echo 0) \
	% $(SLOW_PARTS) + 1 )))

test-slow: $(STAMP) ## one part of the slow tests; parts take turns from commit to commit
	@echo "slow tests: part $(SLOW_PART) of $(SLOW_PARTS)"
	$(PYTEST) -m slow --slow-part $(SLOW_PART)/$(SLOW_PARTS)

PLATFORMS ?= --report build/platforms.md

platforms: $(STAMP) ## quick tests and diagnoses under other CPU settings (an hour); PLATFORMS=--short
	mkdir -p build
	$(BIN)/python benchmarks/platforms.py --jobs $(JOBS) $(PLATFORMS)

bench: $(STAMP) ## time the code against its references; writes reports/performance.md
	mkdir -p build reports
	$(BIN)/python -m pytest benchmarks/test_bench_*.py -m "" --benchmark-only --benchmark-json build/benchmarks.json
	$(BIN)/python benchmarks/ipda_scaling.py > build/ipda_scaling.md
	$(BIN)/python benchmarks/performance.py build/benchmarks.json reports/performance.md \
		build/ipda_scaling.md

reports: bench ## bench, then every other report: the study and benchmarks/report_*.py
	$(BIN)/pikanid study --out reports
	set -e; for script in $(sort $(wildcard benchmarks/report_*.py)); do \
		$(BIN)/python $$script reports; done

notebooks: $(STAMP) ## execute every notebook from top to bottom
	$(BIN)/python -m pytest --nbmake --nbmake-timeout=300 notebooks

clean: ## remove the environment, builds and caches
	rm -rf $(VENV) build mutants dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis .benchmarks
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
