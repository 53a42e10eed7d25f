# Two commands do everything from a fresh clone: `make video` and `make test`. `make help` lists the rest.
SHELL := /bin/bash
PY := .venv/bin/python
PHOTO ?= a2v/samples/person.jpg
ACTION ?= Walk
OUT ?= out/video
WORKERS ?= 2
# of make fuzz: how many inputs are tried, which are drawn, and a file for the numbers
CASES ?= 3000
SEED ?= 1
REPORT ?=
# rendering.py runs Cycles in an environment of its own, through rendering_cycles.py
BENCHMARKS ?= $(filter-out %_cycles.py,$(wildcard benchmarks/*.py))
ARGS ?=
# of which actions there are sheets, and how: arguments of make_motion_sheets.py
MOTIONS ?=
export PYTHON

.PHONY: help setup video page test test-product test-fast slow fuzz bench sheets tables lint notebooks dag clean
.DEFAULT_GOAL := help

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 12

setup: ## install what is needed (Debian packages, .venv, pinned dependencies); again: nothing
	@scripts/setup.sh

video: setup ## PHOTO=… ACTION=… OUT=…: a person and an action to a video; the last line printed is its path
	@$(PY) -m pipelines video --photo $(PHOTO) --action $(ACTION) --out $(OUT) $(ARGS)

page: setup ## a page in the browser: a photo in, a video out; Ctrl-C ends it
	@$(PY) -m pipelines serve --browser $(ARGS)

test: setup ## run every test
	@OMP_NUM_THREADS=1 $(PY) -m pytest -v -n $(WORKERS) --dist loadfile --no-loadscope-reorder --durations=15 $(ARGS)

test-product: setup ## every test but those of the laboratory (tests/lab, tests/export) and of the notebooks
	@OMP_NUM_THREADS=1 $(PY) -m pytest -v -n $(WORKERS) --dist loadfile --no-loadscope-reorder tests --ignore=tests/lab --ignore=tests/export $(ARGS)

test-fast: setup ## the quick files of tests, in under three minutes: for whoever edits
	@OMP_NUM_THREADS=1 $(PY) -m pytest -q -n $(WORKERS) --dist loadfile --no-loadscope-reorder --fast $(ARGS)

slow: setup ## measure every test and list the slow files in tests/slow.txt, which test-fast leaves out
	@OMP_NUM_THREADS=1 $(PY) -m pytest -q -n $(WORKERS) --dist loadfile --no-loadscope-reorder --note-slow $(ARGS)

fuzz: setup ## hostile files, options and requests: CASES=3000 in all, drawn by SEED=1, told in REPORT=FILE
	@PYTHONPATH=. $(PY) scripts/fuzz.py --cases $(CASES) --seed $(SEED) $(if $(REPORT),--report $(REPORT)) $(ARGS)

bench: setup ## measure speed and memory, print tables; BENCHMARKS=benchmarks/pipeline.py for one
	@set -e; for script in $(BENCHMARKS); do echo "== $$script"; $(PY) $$script $(ARGS); done

sheets: setup ## contact sheets of the sample, the photos and avatars, of every action (or MOTIONS="Walk --seeds 1"), and a gallery of PHOTOS=FOLDER, into sheets/
	@$(PY) scripts/make_sheets.py $(ARGS) && $(PY) scripts/make_motion_sheets.py $(MOTIONS) && $(PY) scripts/make_gallery.py $(PHOTOS)

tables: setup ## list the commands that remake the papers' tables; ARGS=--run runs them, ARGS="--run --only cmu" one
	@$(PY) scripts/make_tables.py $(ARGS)

lint: setup ## ruff, spelling, mypy, layers
	@$(PY) -m ruff format --check . && $(PY) -m ruff check . && .venv/bin/codespell && $(PY) -m mypy && .venv/bin/lint-imports

notebooks: setup ## write and execute notebooks/*.ipynb from their .py, and shrink their pictures; ARGS=notebooks/05_photo_to_person.py for one
	@$(PY) scripts/make_notebooks.py $(ARGS)

dag: setup ## draw the pipeline into docs/images/dag.svg
	@$(PY) -m pipelines dag --out docs/images/dag.svg

clean: ## remove outputs and caches of tools, keep .venv and the store
	rm -rf out sheets runs build dist .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
