#!/bin/sh
# Builds the unit's library from these sources, with cargo and a C compiler. For another computer: TARGET is the name that rustc has for it,
# CC a compiler for it.
set -eu
cd "$(dirname "$0")"
cargo rustc --release --lib --crate-type staticlib --manifest-path rust/host/Cargo.toml --target-dir target ${TARGET:+--target "$TARGET"}
"${CC:-cc}" -std=c11 -O2 -fPIC -fvisibility=hidden -shared fmu.c "target/${TARGET:+$TARGET/}release/libcontroller_host.a" -o "${1:-{IDENTIFIER}.so}"
