#!/bin/sh
# Builds the unit's library from these sources, with cargo and a C compiler. For another computer: TARGET is the name that rustc has for it,
# CC a compiler for it, LIBRARIES what it links.
set -eu
cd "$(dirname "$0")"
cargo rustc --release --lib --crate-type staticlib --manifest-path rust/{PACKAGE}/Cargo.toml --target-dir target ${TARGET:+--target "$TARGET"}
"${CC:-cc}" -std=c11 -O2 -fPIC -fvisibility=hidden -shared fmu.c "target/${TARGET:+$TARGET/}release/{ARCHIVE}" ${LIBRARIES-{LIBRARIES}} -o "${1:-{IDENTIFIER}.so}"
