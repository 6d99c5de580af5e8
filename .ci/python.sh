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
log="$target/python-packages.log"
packages=('maturin>=1.9.4' numpy pytest sympy mypy pandas)
if ! pip install --disable-pip-version-check "${packages[@]}" >"$log" 2>&1; then
    cat "$log"
    # Anything else, such as a package that is not there, is a failure.
    offline='NewConnectionError|NameResolutionError|ConnectTimeoutError|Failed to establish a new connection'
    if grep -qE "$offline" "$log"; then
        echo 'skipped: there is no network to install the packages of Python that the tests need'
        exit 0
    fi
    exit 1
fi

cargo clippy --manifest-path "$package" --target-dir "$target" --all-targets --workspace -- -D warnings
# The examples in the documentation, and those that must not compile.
libraries="$(python -c 'import sysconfig; print(sysconfig.get_config_var("LIBDIR"))')"
LD_LIBRARY_PATH="$libraries:${LD_LIBRARY_PATH:-}" \
    cargo test --manifest-path "$package" --target-dir "$target" --doc
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
