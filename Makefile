# make run   a live cloth; SCENE=config/… picks another scene
# make test       ruff, mypy, import-linter and pytest, in minutes
# make test-all   the rest of the tests: those that take longer
# make pictures   the pictures of the README, into docs/pictures
# make study      every figure of the README and docs/ anew; STUDY=--quick in minutes
# make bench      what a substep costs, beside the machine's limit and other engines
# make reliability  torture, extremes, fuzz and faults, and the page that they make; an hour
# make torture    ten thousand random scenes; half an hour
# make extremes   the extremes of every parameter
# make fuzz       bad input of every kind, a hundred thousand cases; ten minutes
# make faults     what a running node outlives: stops, clocks, subscribers, signals and more
# make soak       a live node for an hour: memory, rate, warnings; SECONDS=… for another time
# Each makes the environment in .venv first, once.

SCENE ?= config/gust.yaml
SECONDS ?= 3600
VENV := .venv

# Where ROS 2 is sourced, its own rclpy is used; elsewhere the wheels of ROS 2 Jazzy.
ifneq ($(and $(ROS_DISTRO),$(AMENT_PREFIX_PATH)),)
ROS := sourced
else
ROS := wheels
endif

.PHONY: run test test-all pictures study bench reliability torture extremes fuzz faults soak clean

run: $(VENV)/.ready-run-$(ROS)
	@tools/run.sh $(VENV) '$(SCENE)'

test: $(VENV)/.ready-test-$(ROS)
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports --no-cache
	$(VENV)/bin/python -m pytest -m 'not slow' $(PYTEST_ARGS)

test-all: $(VENV)/.ready-test-$(ROS)
	$(VENV)/bin/python -m pytest -m slow $(PYTEST_ARGS)

pictures: $(VENV)/.ready-pictures-$(ROS)
	$(VENV)/bin/python -m tools.pictures docs/pictures

study: $(VENV)/.ready-run-$(ROS)
	@tools/study.sh $(VENV) $(STUDY)

bench: $(VENV)/.ready-bench-$(ROS)
	$(VENV)/bin/python -m pytest bench --benchmark-json=$(VENV)/bench.json $(BENCH_ARGS)
	$(VENV)/bin/python -m bench.report $(VENV)/bench.json docs/bench

reliability: torture extremes fuzz faults
	$(VENV)/bin/python -m reliability.report

torture: $(VENV)/.ready-test-$(ROS)
	$(VENV)/bin/python -m reliability.torture

extremes: $(VENV)/.ready-test-$(ROS)
	$(VENV)/bin/python -m reliability.extremes

fuzz: $(VENV)/.ready-test-$(ROS)
	$(VENV)/bin/python -m reliability.fuzz

faults: $(VENV)/.ready-run-$(ROS)
	$(VENV)/bin/python -m reliability.faults

soak: $(VENV)/.ready-run-$(ROS)
	$(VENV)/bin/python -m reliability.soak --seconds $(SECONDS)

$(VENV)/.ready-%: setup.py tools/environment.sh
	@tools/environment.sh $(VENV) $*

clean:
	rm -rf $(VENV) build install log *.egg-info .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -prune -exec rm -rf {} +
