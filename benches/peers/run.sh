#!/usr/bin/env bash
# Measures other solvers on the problems of `examples/work_precision.rs`, then ours beside them, and single
# evaluations of accelerations beside what others generate, on this machine.
#
#   benches/peers/run.sh [all | heyoka | scipy | sundials | casadi | crates | ours | evaluation | ensembles |
#                        families]...
#
# Needs Rust; python3 with venv for heyoka, SciPy and whatever integrates Andrews' mechanism; gcc for Andrews'
# mechanism and, with g++, for the evaluations; SUNDIALS 6 with its headers (Debian: libsundials-dev). The
# script skips a part whose programs are missing, and says so. Everything is installed into a folder of its
# own below `$CARGO_TARGET_DIR` or `benches/peers/target`. It takes about 20 minutes in all, most of it for
# SciPy's implicit methods and for compiling.
#
# PEERS_PYTHON names a Python that has heyoka, scipy, numba and casadi already. PEERS_PREFIX is put before
# every measurement, for example `nice -n -20 taskset -c 1`. Results are lines of JSON in `results/`: see
# `Study::add_outside`. They are true of one machine and are not committed.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
work="${CARGO_TARGET_DIR:-$here/target}/peers"
read -r -a prefix <<<"${PEERS_PREFIX:-}"
mkdir -p "$here/results" "$work/generated"
python="${PEERS_PYTHON:-$work/venv/bin/python}"

skip() { echo "$1 passed over: $2" >&2; }

# Installs a package of Python.
pip_install() { "$python" -m pip install --quiet --disable-pip-version-check "$1"; }

# Whether Python has these packages, which are installed if possible. Stops at the first that is missing.
have() {
    if [ ! -x "$python" ]; then
        if [ -n "${PEERS_PYTHON:-}" ] || ! python3 -m venv "$work/venv" 2>/dev/null; then
            rm -rf "$work/venv"
            return 1
        fi
    fi
    local package
    for package in "$@"; do
        if "$python" -c "import $package" 2>/dev/null; then continue; fi
        if [ -n "${PEERS_PYTHON:-}" ] || ! pip_install "$package"; then return 1; fi
    done
}

# Andrews' mechanism as C, which CasADi writes.
andrews() {
    if [ -e "$work/generated/andrews.h" ]; then return; fi
    have casadi && "$python" "$here/python/andrews_c.py" "$work/generated"
}
no_casadi="CasADi, which writes its right-hand side, cannot be installed for python3 here"

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
    echo "$(wc -l <"$here/results/$name.jsonl") runs in results/$name.jsonl"
}

heyoka() {
    have heyoka || { skip heyoka "it cannot be installed for python3 here"; return; }
    measure heyoka "$python" "$here/python/run_heyoka.py"
}

scipy() {
    have scipy numba || { skip SciPy "it or numba cannot be installed for python3 here"; return; }
    measure scipy "$python" "$here/python/run_scipy.py"
}

sundials() {
    command -v gcc >/dev/null || { skip SUNDIALS "there is no gcc"; return; }
    andrews || { skip SUNDIALS "$no_casadi"; return; }
    local libraries="cvode ida nvecserial sunmatrixdense sunlinsoldense sunnonlinsolfixedpoint"
    # shellcheck disable=SC2046
    if ! gcc -O3 -march=native -I"$work/generated" "$here/sundials/run.c" -o "$work/sundials" \
        $(printf -- '-lsundials_%s ' $libraries) -lm 2>"$work/sundials.log"; then
        local log="$work/sundials.log"
        skip SUNDIALS "its headers or libraries are not installed, or are of another version ($log)"
        return
    fi
    measure sundials "$work/sundials"
}

# SUNDIALS as CasADi's wheel brings it along: an older one, but it installs everywhere.
casadi() {
    command -v gcc >/dev/null || { skip "CasADi's SUNDIALS" "there is no gcc"; return; }
    have casadi || { skip "CasADi's SUNDIALS" "CasADi cannot be installed for python3 here"; return; }
    # CasADi leaves the C that it writes where it runs.
    (cd "$work/generated" && measure casadi "$python" "$here/python/run_casadi.py")
}

crates() {
    local generated="$work/generated"
    if ! command -v gcc >/dev/null || ! andrews; then
        skip "Andrews' mechanism by the crates" "there is no gcc, or $no_casadi"
        generated=
    fi
    if ! PEERS_GENERATED="$generated" RUSTFLAGS="-C target-cpu=native" cargo build --release --quiet \
        --manifest-path "$here/crates/Cargo.toml" --target-dir "$work/crates"; then
        skip "the crates" "they cannot be built"
        return
    fi
    measure crates "$work/crates/release/dynamics-peers-crates"
}

ours() {
    RUSTFLAGS="-C target-cpu=native" cargo build --release --quiet --manifest-path "$here/../../Cargo.toml" \
        --features json --example work_precision --target-dir "$work/ours"
    "${prefix[@]}" "$work/ours/release/examples/work_precision"
}

# The table of single evaluations: CasADi's, SymPy's and Pinocchio's generated C, Pinocchio and MuJoCo at run
# time, among the candidates of `benches/evaluation.rs`.
evaluation() {
    command -v gcc >/dev/null || { skip "the table of evaluations" "there is no gcc"; return; }
    have casadi || { skip "the table of evaluations" "CasADi cannot be installed for python3 here"; return; }
    local to="$work/evaluation" site further=() objects=()
    rm -rf "$to"
    mkdir -p "$to"
    site="$("$python" -c 'import casadi, os; print(os.path.dirname(os.path.dirname(casadi.__file__)))')"
    "$python" "$here/python/evaluation_c.py" "$to" >"$to/casadi.txt"
    if have sympy; then
        "$python" "$here/python/evaluation_sympy.py" "$to" >"$to/sympy.txt"
    else
        skip SymPy "it cannot be installed for python3 here"
    fi
    pinocchio_c && further=({double_pendulum,chain_5,chain_10,chain_20,chain_50,arm}_aba_at_run_time)
    mujoco_c && further+=(arm_mujoco_forward arm_mujoco_parts)
    "$python" "$here/python/evaluation_table.py" "$to" "${further[@]}"
    local source
    for source in "$to"/peer_*.c "$to/table.c"; do
        gcc -O3 -march=native -ffp-contract=fast -fPIC -I"$to" -c "$source" -o "${source%.c}.o"
    done
    # shellcheck disable=SC2046
    g++ -shared "$to"/*.o -o "$to/libpeers_evaluation.so" $(cat "$to"/*.link 2>/dev/null) -lm
    if ! PEERS_LIBRARY="$to" RUSTFLAGS="-C target-cpu=native" cargo build --release --quiet \
        --manifest-path "$here/evaluation/Cargo.toml" --target-dir "$work/ours"; then
        skip "the table of evaluations" "it cannot be built"
        return
    fi
    "${prefix[@]}" "$work/ours/release/dynamics-peers-evaluation" | tee "$here/results/evaluation.txt"
}

# Ensembles: this library's before and after heyoka's batches, in one table.
ensembles() {
    have heyoka numpy || { skip ensembles "heyoka or NumPy cannot be installed for python3 here"; return; }
    local ours=(cargo bench --quiet --manifest-path "$here/../../Cargo.toml" -p dynamics-benches --bench ensembles)
    # A default build: the vectors are chosen at run time.
    ours+=(--target-dir "$work/plain" -- double)
    {
        ENSEMBLES_TO="$work" "${prefix[@]}" "${ours[@]}"
        "${prefix[@]}" "$python" "$here/python/run_heyoka_batch.py" "$work/double_pendulums.csv"
        "${prefix[@]}" "${ours[@]}"
    } | tee "$here/results/ensembles.txt"
}

# Models with families beside C by gcc, in one process, then NumPy and PyElastica.
families() {
    command -v gcc >/dev/null || { skip "models with families" "there is no gcc"; return; }
    # A default build: the vectors are chosen at run time.
    cargo build --release --quiet --manifest-path "$here/families/Cargo.toml" --target-dir "$work/families"
    measure families "$work/families/release/dynamics-peers-families"
    have numpy || { skip "NumPy" "it cannot be installed for python3 here"; return; }
    have elastica || pip_install pyelastica || echo "PyElastica cannot be installed for python3 here" >&2
    measure families_python "$python" "$here/python/run_families.py"
}

# Pinocchio's algorithms: generated as C, and compiled as they are.
pinocchio_c() {
    if ! "$python" -c "import pinocchio" 2>/dev/null && ! pip_install pin; then
        skip Pinocchio "it cannot be installed for python3 here"
        return 1
    fi
    local root="$site/cmeel.prefix" flags
    flags="-std=c++17 -DNDEBUG -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS"
    flags+=" -I$root/include -I$site/casadi/include -I$site/casadi/include/eigen3"
    # shellcheck disable=SC2086
    if ! g++ -O1 $flags "$here/pinocchio/generate.cpp" -o "$to/generate" -L"$root/lib" -lpinocchio_default \
        -L"$site/casadi" -lcasadi -Wl,-rpath,"$root/lib:$site/casadi" 2>"$to/pinocchio.log" ||
        ! "$to/generate" "$to" double_pendulum chain:5 chain:10 chain:20 chain:50 arm >"$to/pinocchio.txt" ||
        ! g++ -O3 -march=native -fPIC $flags -c "$here/pinocchio/run.cpp" -o "$to/run.o" \
            2>>"$to/pinocchio.log"; then
        skip Pinocchio "its headers cannot be compiled ($to/pinocchio.log)"
        rm -f "$to/pinocchio.txt" "$to/run.o"
        return 1
    fi
    echo "-L$root/lib -lpinocchio_default -Wl,-rpath,$root/lib" >"$to/pinocchio.link"
}

# MuJoCo on the arm.
mujoco_c() {
    have mujoco || { skip MuJoCo "it cannot be installed for python3 here"; return 1; }
    local library
    library="$(ls "$site"/mujoco/libmujoco.so.* | head -1)"
    if ! gcc -O3 -march=native -fPIC -I"$site/mujoco/include" -c "$here/mujoco/arm.c" -o "$to/mujoco.o" \
        2>"$to/mujoco.log"; then
        skip MuJoCo "its headers cannot be compiled ($to/mujoco.log)"
        return 1
    fi
    echo "$library -Wl,-rpath,$site/mujoco" >"$to/mujoco.link"
}

parts=("$@")
if [ ${#parts[@]} -eq 0 ] || [ "${parts[0]}" = all ]; then
    parts=(heyoka scipy sundials casadi crates ours evaluation ensembles families)
fi
for name in "${parts[@]}"; do
    case "$name" in
    heyoka | scipy | sundials | casadi | crates | ours | evaluation | ensembles | families) ;;
    *)
        echo "there is no part $name; there are heyoka, scipy, sundials, casadi, crates, ours, evaluation, ensembles, families" >&2
        exit 2
        ;;
    esac
done
for name in "${parts[@]}"; do "$name"; done
