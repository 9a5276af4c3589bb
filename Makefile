# haploop: everything runs from a fresh clone with Python 3.11 or newer, pip and make; `make` alone lists the targets.
PYTHON ?= python3
UV ?= uv
BIN := .venv/bin
# One more than there are processors: some tests wait for processes of their own.
WORKERS ?= $(shell expr $$(getconf _NPROCESSORS_ONLN) + 1)
# Of the slow ones more tests do.
MORE_WORKERS ?= $(shell expr $(WORKERS) + 1)
SEEDS ?= 2000
N ?= 50
FROM ?= 0
GRID ?= --no-grid
# A history of make bench, as runs/bench.jsonl is.
COMPARE ?=
HELD = $(if $(COMPARE),--compare $(COMPARE))
PIP := $(PYTHON) -m pip --python $(BIN)/python -qq --disable-pip-version-check --no-input
READY := .venv/.installed

QUICK := tests/scene tests/log tests/estimators tests/clock $(patsubst %,tests/physics/%.py,\
  motion/test_step motion/test_stability motion/test_timing_rules motion/test_event_timing \
  energy/test_leak energy/test_energy_per_sample sensing/test_random_stream)

.DEFAULT_GOAL := help
.PHONY: help demo quick test slow everywhere simulate faults check bench accuracy paper comparison docs pictures notebook lock clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-10s %s\n", $$1, $$2 }' Makefile

demo: $(READY) ## tell how a wall buzzes, why, and what steadies it; the last line names the figure's file
	@$(BIN)/haploop demo

quick: $(READY) ## run the tests of scene, log, estimators, clock and physics in closed form (below 30 s)
	@$(BIN)/pytest -q -n $(WORKERS) --dist worksteal --hypothesis-profile quick -m "not slow" \
	  -k "not as_processes and not compiles" $(QUICK)

test: $(READY) ## run the tests
	@$(BIN)/pytest -q -n $(WORKERS) --dist worksteal -m "not slow"

slow: $(READY) ## run the slow tests (that there are none is no failure: pytest then exits with 5)
	@$(BIN)/pytest -q -n $(MORE_WORKERS) --dist worksteal -m slow || [ $$? -eq 5 ]

everywhere: $(READY) ## bits of every scene and the tests, whatever processor, CPython and dependencies (an hour; ONLY=name)
	@PYTHONPATH=tests $(BIN)/python -m everywhere.command --only "$(ONLY)"

simulate: $(READY) ## play SEEDS simulated histories from seed FROM on; stopped, it goes on where it was
	@PYTHONPATH=tests $(BIN)/python -m simulation.command --seeds $(SEEDS) --from $(FROM)

faults: $(READY) ## strike N real runs with faults from seed FROM on (about two seconds each)
	@PYTHONPATH=tests $(BIN)/python -m faults.campaign.command $(FROM) $(N)

check: $(READY) ## lint, format, types and the arrows between the packages
	@$(BIN)/ruff check
	@$(BIN)/ruff format --check
	@$(BIN)/pyright
	@$(BIN)/lint-imports

bench: $(READY) ## measure speed, memory, what each effect and the live page cost on this machine (about twelve minutes); COMPARE=FILE marks what is slower than in that history
	@$(BIN)/python tests/bench/bench.py $(HELD)
	@$(BIN)/python tests/bench/memory.py
	@$(BIN)/python tests/bench/ablation.py
	@$(BIN)/python tests/bench/view.py
	@$(BIN)/python tests/bench/arrays.py $(HELD)
	@$(BIN)/python tests/bench/sweep.py

accuracy: $(READY) ## measure what accuracy costs and write docs/accuracy.md (four minutes on two idle cores; stopped, it goes on where it was)
	@$(BIN)/haploop cost --out runs/accuracy
	@cp docs/accuracy.md runs/accuracy/page_before.md
	@$(BIN)/python -m haploop.tools.cost.page runs/accuracy docs
	@$(BIN)/python tests/bench/plants.py docs/accuracy.md runs/accuracy/page_before.md

paper: $(READY) ## make every figure of the paper, write docs/paper.md and paper_claims.md (some 20 minutes on two cores; stopped, it goes on)
	@$(BIN)/haploop paper --out runs/paper
	@$(BIN)/python -m haploop.tools.studies.choi2022.command runs/paper docs
	@cp runs/paper/fig6?_nearest.toml launch/scenes/paper/
	@cp runs/paper/premium_press.toml launch/scenes/

comparison: $(READY) ## compare every stabilizer on three devices and write docs/comparison.md (20 minutes on two quiet cores; stopped, it goes on)
	@$(BIN)/python -m haploop.tools.compare.page runs/comparison docs

docs: $(READY) ## make the documentation as a site in site/ (index.html); a warning is an error
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo 'site/index.html (to search it, too: python3 -m http.server -d site)'

pictures: $(READY) ## make the pictures of README's walk anew (two minutes; that of the page needs Chromium)
	@$(BIN)/python docs/site/pictures.py docs/pictures
	@$(BIN)/python docs/site/page_picture.py docs/view.png

notebook: $(READY) ## run docs/notebook.ipynb anew and keep its figures
	@$(BIN)/python -m haploop.tools.notebook docs/notebook.ipynb

lock: ## pin every dependency anew with its hashes in requirements.lock (needs uv)
	$(UV) pip compile pyproject.toml --all-extras --output-file requirements.lock --upgrade --quiet \
	  --universal --python-version 3.11 --fork-strategy fewest --generate-hashes \
	  --no-emit-index-url --no-emit-find-links --no-annotate --no-header

clean: ## remove the virtual environment, the runs and every cache
	rm -rf .venv runs site dist build .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find nodes protocol launch tools tests -name __pycache__ -type d -prune -exec rm -rf {} +

# A new lock means a new environment; a change of pyproject.toml only means installing haploop itself again.
# The environment is made without pip and filled from outside, so a Python without ensurepip (Debian's) will do.
.venv/.locked: requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "haploop needs Python 3.11 or newer, but $(PYTHON) is Python %d.%d; name another one: make PYTHON=python3.11" % sys.version_info[:2])'
	@echo "setting up .venv (about a minute, once)"
	@$(PYTHON) -m venv --clear --without-pip .venv
	@$(PIP) install --require-hashes -r requirements.lock
	@touch $@

$(READY): .venv/.locked pyproject.toml
	@$(PIP) install --no-deps --no-build-isolation -e .
	@touch $@
