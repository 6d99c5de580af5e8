#!/usr/bin/env bash
# Models as a Python module: lints of `dynamics-python`, the wheel of its example in a fresh environment, and
# the tests there. Needs Python 3.9 or newer with `venv`, and packages from where pip finds them.
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_TERM_COLOR=never CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=0
target="$(realpath -m "${CARGO_TARGET_DIR:-target}")"
package=dynamics-python/Cargo.toml example=dynamics-python/example
python="${DYNAMICS_PYTHON:-python3}"

cargo fmt --manifest-path "$package" --all --check

environment="$target/python"
rm -rf "$environment" "$target/wheels"
"$python" -m venv "$environment"
export VIRTUAL_ENV="$environment" PATH="$environment/bin:$PATH" PYO3_PYTHON="$environment/bin/python"
if ! pip install --quiet --disable-pip-version-check maturin numpy pytest sympy mypy pandas; then
    echo 'skipped: the packages of Python that the tests need cannot be installed here'
    exit 0
fi

cargo clippy --manifest-path "$package" --target-dir "$target" --all-targets --workspace -- -D warnings
# One wheel for Python 3.9 and everything newer.
maturin build --release --target-dir "$target" --out "$target/wheels" --manifest-path "$example/Cargo.toml"
ls "$target"/wheels/mechanisms-*-cp39-abi3-*.whl
pip install --quiet --disable-pip-version-check "$target"/wheels/*.whl

# Not in the folder of the sources: the installed module is tested.
tests="$PWD/$example"
cd "$environment"
pytest --quiet -p no:cacheprovider "$tests/tests"
mypy --strict --cache-dir "$environment/mypy" "$tests/tests/typed.py"
python "$tests/sympy_pendulum.py"
