# Two commands: `make demo` and `make test`. Both set up .venv first; a second run starts at once.
PYTHON ?= python3
BIN := .venv/bin
SYSTEM_LIBRARIES := libegl1 libgl1 libgomp1 libusb-1.0-0
BENCHES := detection planning scans stitching

.PHONY: demo test check bench $(addprefix bench-,$(BENCHES)) train-detector train-folds lock clean

demo: .venv/.ready
	$(BIN)/hairline demo --out runs/demo

test: .venv/.ready check
	$(BIN)/python -m pytest -q -n 2 --dist loadfile  # on two cores; fixtures are made once a file

check: .venv/.ready
	$(BIN)/ruff check -q
	$(BIN)/ruff format -q --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

bench: $(addprefix bench-,$(BENCHES))

$(addprefix bench-,$(BENCHES)): bench-%: .venv/.ready
	$(BIN)/python -m tests.benchmarks.$* $(ARGS)

train-detector: .venv/.ready  # two hours on two cores; PHOTOS=FOLDER holds images/, masks/ and groups.txt
	@[ -n "$(PHOTOS)" ] || { echo "Name the photos: make train-detector PHOTOS=FOLDER"; exit 1; }
	$(BIN)/python -m pip install -q --disable-pip-version-check -e '.[train]'
	$(BIN)/python -m training.surfaces build/training/surfaces 900
	$(BIN)/python -m training.train $(PHOTOS) build/training/surfaces build/training/run --fold 0
	$(BIN)/python -m training.export build/training/run/weights.pt build/training/hairline.onnx

train-folds: .venv/.ready  # half an hour each: a network for each fold, for bench-detection
	@[ -n "$(PHOTOS)" ] || { echo "Name the photos: make train-folds PHOTOS=FOLDER"; exit 1; }
	$(BIN)/python -m pip install -q --disable-pip-version-check -e '.[train]'
	$(BIN)/python -m training.surfaces build/training/surfaces 900
	mkdir -p build/training/folds
	for k in 0 1 2 3 4; do \
	  $(BIN)/python -m training.train $(PHOTOS) build/training/surfaces build/training/fold$$k --fold $$k --steps 8000 \
	  && $(BIN)/python -m training.export build/training/fold$$k/weights.pt build/training/folds/$$k.onnx 1.1 -1 \
	  || exit 1; done

.venv/.ready: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' \
	  || { echo "Hairline needs Python 3.11 to 3.13; name one: make $(MAKECMDGOALS) PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -m venv .venv \
	  || { echo "Python's venv module is missing. Type: apt-get install python3-venv"; exit 1; }
	$(BIN)/python -m pip install -q --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-deps -e .
	@$(BIN)/python -c 'import open3d' 2>/dev/null \
	  || { [ "$$(id -u)" = 0 ] && apt-get update -qq && apt-get install -y -qq $(SYSTEM_LIBRARIES); } \
	  || { echo "Open3D needs system libraries. Type: sudo apt-get install $(SYSTEM_LIBRARIES)"; exit 1; }
	@touch $@

lock:  # after a change of pyproject.toml's dependencies; needs uv
	uv pip compile --universal --python-version 3.11 pyproject.toml --extra test -o requirements.lock \
	  --no-annotate --no-header

clean:
	rm -rf build .mypy_cache .pytest_cache .ruff_cache
