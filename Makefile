# make run        a live node; SCENE=config/… selects another scene
# make demo       a live node and its view in a browser; SCENE=config/… selects another scene
# make test       ruff, mypy, import-linter and pytest, in minutes
# make test-all   the rest of the tests: those that take longer
# make docs       the documentation as a site that works offline, in build/docs
# make pictures   render all scenes and the animation, into docs/pictures; SCENE=… one scene
# make study      measure speed against accuracy for the README and docs/; STUDY=--quick is short
# make refinement convergence of the grid: docs/validation/refinement.md, a minute
# make bench      cost of a substep, with the limit of the processor and other engines
# make reliability    all of the following, and docs/reliability.md; more than two hours
# make random-scenes  ten thousand random scenes; half an hour; SEED=… for others
# make extremes       extremes of every parameter
# make fuzz           bad input of every kind; a quarter of an hour
# make faults         a running node: stops, clocks, subscribers, signals and more
# make soak           a live node for an hour: memory, rate, warnings; SECONDS=… for another time
# make clean      remove the environment and all that was built
# make help       print this list
# Each but the last two makes the environment in .venv first, once.

SCENE ?= config/gust.yaml
SECONDS ?= 3600
SEED ?= 0
VENV := .venv
# Test files are shared by two processes: a live node of a test needs a core of its own.
WORKERS := --numprocesses 2 --dist loadfile --no-loadscope-reorder

# Where ROS 2 is sourced, its own rclpy is used; elsewhere the wheels of ROS 2 Jazzy.
ifneq ($(and $(ROS_DISTRO),$(AMENT_PREFIX_PATH)),)
ROS := sourced
else
ROS := wheels
endif

.PHONY: run demo test test-all docs pictures study refinement bench reliability random-scenes extremes \
    fuzz faults soak clean help

run: $(VENV)/.ready-run-$(ROS)
	@tools/run.sh $(VENV) '$(SCENE)'

demo: $(VENV)/.ready-viewer-$(ROS)
	@$(VENV)/bin/python -m tools.demo '$(SCENE)'

test: $(VENV)/.ready-test-$(ROS)
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports --no-cache
	$(if $(PYTEST_ARGS),,$(VENV)/bin/python test/kernels.py)
	$(VENV)/bin/python -m pytest $(WORKERS) -m 'not slow' $(PYTEST_ARGS)

test-all: $(VENV)/.ready-test-$(ROS)
	$(VENV)/bin/python -m pytest $(WORKERS) -m slow $(PYTEST_ARGS)

docs: $(VENV)/.ready-docs-$(ROS)
	$(VENV)/bin/python -m sphinx --fail-on-warning --keep-going docs build/docs
	@echo 'open build/docs/index.html'

pictures: $(VENV)/.ready-pictures-$(ROS)
	$(VENV)/bin/python -m tools.pictures $(if $(filter file,$(origin SCENE)),,'$(SCENE)')

study: $(VENV)/.ready-run-$(ROS)
	@tools/study.sh $(VENV) $(STUDY)

refinement: $(VENV)/.ready-run-$(ROS)
	$(VENV)/bin/python -m tools.refinement

bench: $(VENV)/.ready-bench-$(ROS)
	$(VENV)/bin/python -m pytest bench --benchmark-json=$(VENV)/bench.json $(BENCH_ARGS)
	$(VENV)/bin/python -m bench.report $(VENV)/bench.json docs/bench

# The long form of the reliability tests.
RELIABILITY = $(VENV)/bin/python -m pytest -m reliability --long --timeout 0 \
    --hypothesis-seed $(SEED) --soak-seconds $(SECONDS) $(PYTEST_ARGS)
IN := test/reliability

reliability: $(VENV)/.ready-test-$(ROS)
	$(RELIABILITY) --junitxml $(VENV)/reliability.xml $(IN); code=$$?; \
	$(VENV)/bin/python -m tools.reliability_page $(VENV)/reliability.xml && exit $$code

random-scenes: $(VENV)/.ready-test-$(ROS)
	$(RELIABILITY) $(IN)/test_random_scenes.py

extremes: $(VENV)/.ready-test-$(ROS)
	$(RELIABILITY) $(IN)/test_extremes.py

fuzz: $(VENV)/.ready-test-$(ROS)
	$(RELIABILITY) $(IN)/test_fuzz_*.py

faults: $(VENV)/.ready-test-$(ROS)
	$(RELIABILITY) $(IN)/test_fault*.py $(IN)/test_live_states.py

soak: $(VENV)/.ready-test-$(ROS)
	$(RELIABILITY) $(IN)/test_soak.py

$(VENV)/.ready-%: setup.py tools/environment.sh
	@tools/environment.sh $(VENV) $*

clean:
	rm -rf $(VENV) build install log *.egg-info .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -prune -exec rm -rf {} +

help:
	@sed -n '/^#/!q; s/^# //p' $(firstword $(MAKEFILE_LIST))
