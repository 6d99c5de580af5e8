#!/usr/bin/env bash
# Measures other solvers on the problems of `examples/work_precision.rs`, then ours beside them, on this machine.
#
#   benches/peers/run.sh [all | heyoka | scipy | sundials | crates | ours]...
#
# Needs python3 with venv, gcc, SUNDIALS 6 with its headers (Debian: libsundials-dev; without it that part is passed over, and says so) and Rust.
# PEERS_PYTHON names a Python that has heyoka, scipy, numba and casadi already. PEERS_PREFIX is put before every measurement, for example
# `nice -n -20 taskset -c 1`. Results are lines of JSON in `results/`: see `Study::add_outside`. They are true of one machine and are not committed.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
work="${CARGO_TARGET_DIR:-$here/target}/peers"
read -r -a prefix <<<"${PEERS_PREFIX:-}"
mkdir -p "$here/results" "$work/generated"

python="${PEERS_PYTHON:-$work/venv/bin/python}"
if [ ! -x "$python" ]; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet heyoka scipy numba casadi
fi
"$python" "$here/python/andrews_c.py" "$work/generated"

# A part that fails leaves what it had measured before.
measure() {
    local name="$1"
    shift
    echo "== $name"
    if ! "${prefix[@]}" "$@" >"$work/$name.jsonl"; then
        echo "$name failed: its curves are those of an earlier run, if there are any" >&2
        return
    fi
    mv "$work/$name.jsonl" "$here/results/$name.jsonl"
    wc -l "$here/results/$name.jsonl"
}

part() {
    case "$1" in
    heyoka) measure heyoka "$python" "$here/python/run_heyoka.py" ;;
    scipy) measure scipy "$python" "$here/python/run_scipy.py" ;;
    sundials)
        if [ ! -e /usr/include/cvode/cvode.h ]; then
            echo "SUNDIALS is not installed: no curves of CVODE and IDA" >&2
            return
        fi
        libraries="cvode ida nvecserial sunmatrixdense sunlinsoldense sunnonlinsolfixedpoint"
        # shellcheck disable=SC2046
        gcc -O3 -march=native -I"$work/generated" "$here/sundials/run.c" -o "$work/sundials" $(printf -- '-lsundials_%s ' $libraries) -lm
        measure sundials "$work/sundials"
        ;;
    crates)
        export PEERS_GENERATED="$work/generated" RUSTFLAGS="-C target-cpu=native"
        cargo build --release --quiet --manifest-path "$here/crates/Cargo.toml" --target-dir "$work/crates"
        measure crates "$work/crates/release/dynamics-peers-crates"
        ;;
    ours)
        export RUSTFLAGS="-C target-cpu=native"
        cargo build --release --quiet --manifest-path "$here/../../Cargo.toml" --example work_precision --target-dir "$work/ours"
        "${prefix[@]}" "$work/ours/release/examples/work_precision"
        ;;
    *)
        echo "there is no part $1; there are heyoka, scipy, sundials, crates, ours" >&2
        exit 2
        ;;
    esac
}

parts=("$@")
if [ ${#parts[@]} -eq 0 ] || [ "${parts[0]}" = all ]; then
    parts=(heyoka scipy sundials crates ours)
fi
for name in "${parts[@]}"; do part "$name"; done
