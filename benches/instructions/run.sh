#!/usr/bin/env bash
# Counts instructions and fails where one of the counts in benches/counts.rs is exceeded. Needs valgrind and
# gungraun's runner (`cargo install --version 0.20.0 gungraun-runner`); says so and succeeds where they are
# absent.
set -euo pipefail
cd "$(dirname "$0")"
if ! command -v valgrind >/dev/null; then
    echo "skipped: there is no valgrind, so that instructions are not counted"
    exit 0
fi
if ! command -v "${GUNGRAUN_RUNNER:-gungraun-runner}" >/dev/null; then
    echo "skipped: there is no gungraun-runner; cargo install --version 0.20.0 gungraun-runner"
    exit 0
fi
# Counts are those of plain x86-64, whatever this machine and its settings are.
unset RUSTFLAGS
exec cargo bench --bench instructions "$@"
