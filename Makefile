# make run      set up everything, then size, shape, mesh, solve and judge the paper's sensor
# make design   the files for fabrication and the verdicts on their geometry
# make test     set up everything, then lint, types and every test that takes some seconds at most
# make test-all the slow tests too
# make test-studies those that take minutes in all: hostile files, odd machines, solids in another solver
# make bench-peers  the other programs that make bench compares with, in an environment of their own
# make lint | bench | view | clean | setup | lock

SHELL := /bin/bash
.DEFAULT_GOAL := run
.PHONY: run design test test-all test-studies lint bench bench-peers view clean setup lock

BIN := .venv/bin
WORKERS ?= 2
STAMP := .venv/.set-up

# Each test worker has one core: numerical libraries that start more threads only wait for each other.
ONE_THREAD := OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

# Compiled sources are kept: the processes that tests start read them.
unexport PYTHONDONTWRITEBYTECODE

setup: $(STAMP)

$(STAMP): pyproject.toml requirements.lock .ci/setup
	@PYTHON=$(PYTHON) bash .ci/setup
	@touch $@

run: setup
	$(BIN)/pipeline run --nl 0.05

design: setup
	$(BIN)/pipeline design

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --num-workers $(WORKERS)
	$(BIN)/lint-imports

test: lint
	$(ONE_THREAD) $(BIN)/pytest -n $(WORKERS) --dist worksteal -m "not slow and not study"

test-all: lint
	$(ONE_THREAD) $(BIN)/pytest -n $(WORKERS) --dist worksteal -m "not study"

test-studies: setup
	$(ONE_THREAD) $(BIN)/pytest -n $(WORKERS) --dist worksteal -m study

bench: setup
	$(BIN)/python -m benchmarks

.venv-peers/.set-up: requirements-peers.lock .ci/peers
	@PYTHON=$(PYTHON) bash .ci/peers
	@touch $@

bench-peers: .venv-peers/.set-up

view: setup
	$(BIN)/pipeline view outputs/paper

lock:
	PYTHON=$(PYTHON) bash .ci/lock

clean:
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find sensor cad mesh solve pipeline instrument twintip reference benchmarks tests -name __pycache__ -type d -prune -exec rm -rf {} +
	find outputs -mindepth 1 -maxdepth 1 ! -name README.md -exec rm -rf {} +
