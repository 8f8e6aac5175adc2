#!/bin/sh
# Builds the unit's library from these sources, with cargo and a C compiler. For another computer: set TARGET to its rustc target,
# CC to a compiler for it, and LIBRARIES to the libraries to link.
set -eu
cd "$(dirname "$0")"
cargo rustc --release --lib --crate-type staticlib --manifest-path rust/{PACKAGE}/Cargo.toml --target-dir target ${TARGET:+--target "$TARGET"}
"${CC:-cc}" -std=c11 -O2 -fPIC -fvisibility=hidden -shared fmu.c "target/${TARGET:+$TARGET/}release/{ARCHIVE}" ${LIBRARIES-{LIBRARIES}} -o "${1:-{IDENTIFIER}.so}"
