//! The inverse dynamics of the controller beside C, in one run: `cargo bench -p specgen-benches --bench beside_c`.
//!
//! The C is straight-line code, traced from the very kernel with the constants of the reference platform: what a code generator
//! makes of it at best. `cc -O3` compiles it for x86-64-v2 with the operations as they are, so that its bits are the kernel's, and for
//! this computer with products and sums fused. Times are the least of many rounds over 1,024 motions, Rust and C by turns.

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use controller::body::PLATFORM;
use specgen::compile::compile;
use specgen_runtime::snapshot::Field;
use specgen_runtime::{Motion, Platform, Real};
use specgen_tests::{motions, repository};

const MOTIONS: usize = 1024;
const ROUNDS: usize = 200;
const TURNS: usize = 5;
/// Name, arguments, and whether its bits are to be the kernel's.
const COMPILERS: [(&str, &[&str], bool); 2] = [
    ("-march=x86-64-v2 -ffp-contract=off", &["-march=x86-64-v2", "-ffp-contract=off"], true),
    ("-march=native", &["-march=native"], false),
];

thread_local! {
    /// Lines of C so far; `Real` is `Copy + 'static`, so that numbers cannot carry them.
    static LINES: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

/// A number of the traced kernel: known, or the variable of that place.
#[derive(Debug, Clone, Copy)]
enum Number {
    Known(f64),
    Variable(usize),
}

impl Number {
    fn input(k: usize) -> Self {
        Self::line(format!("in[{k}]"))
    }

    fn line(expression: String) -> Self {
        LINES.with_borrow_mut(|lines| {
            lines.push(expression);
            Self::Variable(lines.len() - 1)
        })
    }

    fn text(self) -> String {
        match self {
            // All digits of a double.
            Self::Known(value) => format!("({value:e})"),
            Self::Variable(place) => format!("v{place}"),
        }
    }

    fn binary(self, sign: char, other: Self, known: fn(f64, f64) -> f64) -> Self {
        match (self, other) {
            (Self::Known(a), Self::Known(b)) => Self::Known(known(a, b)),
            _ => Self::line(format!("{} {sign} {}", self.text(), other.text())),
        }
    }

    fn known(self) -> f64 {
        match self {
            Self::Known(value) => value,
            Self::Variable(_) => f64::NAN,
        }
    }
}

impl Add for Number {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.binary('+', other, |a, b| a + b)
    }
}

impl Sub for Number {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.binary('-', other, |a, b| a - b)
    }
}

impl Mul for Number {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.binary('*', other, |a, b| a * b)
    }
}

impl Div for Number {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        self.binary('/', other, |a, b| a / b)
    }
}

impl Neg for Number {
    type Output = Self;
    fn neg(self) -> Self {
        match self {
            Self::Known(value) => Self::Known(-value),
            Self::Variable(_) => Self::line(format!("-{}", self.text())),
        }
    }
}

impl PartialEq for Number {
    /// The kernel compares constants only.
    fn eq(&self, other: &Self) -> bool {
        self.known() == other.known()
    }
}

impl PartialOrd for Number {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.known().partial_cmp(&other.known())
    }
}

impl Field for Number {
    const WORDS: usize = 1;
}

impl Real for Number {
    const ZERO: Self = Self::Known(0.0);
    const HALF: Self = Self::Known(0.5);
    const ONE: Self = Self::Known(1.0);
    const SINGLE: bool = false;

    fn from_f64(value: f64) -> Self {
        Self::Known(value)
    }
    fn truncate(self) -> i32 {
        self.known() as i32
    }
    fn from_i32(value: i32) -> Self {
        Self::Known(f64::from(value))
    }
    fn is_finite(self) -> bool {
        self.known().is_finite()
    }
    fn abs(self) -> Self {
        Self::Known(self.known().abs())
    }
    fn to_word(self) -> u64 {
        self.known().to_bits()
    }
    fn from_word(word: u64) -> Self {
        Self::Known(f64::from_bits(word))
    }
}

/// The kernel as C.
fn traced(platform: &Platform<Number>) -> String {
    let six = |first: usize| std::array::from_fn(|k| Number::input(first + k));
    let motion = Motion { pose: six(0), rate: six(6), acceleration: six(12) };
    let forces = platform.leg_forces(&motion);
    let mut c = "static void kernel(const double *restrict in, double *restrict out) {\n".to_owned();
    LINES.with_borrow(|lines| {
        c.extend(
            lines.iter().enumerate().map(|(place, expression)| format!("  const double v{place} = {expression};\n")),
        );
    });
    c.extend(forces.into_iter().enumerate().map(|(leg, force)| format!("  out[{leg}] = {};\n", force.text())));
    c.push_str("}\n");
    c
}

/// Reads motions, times the kernel on them, writes the forces; prints the least time of a motion, ns.
fn program(kernel: &str) -> String {
    format!(
        "#include <stdio.h>\n#include <time.h>\n{kernel}
__attribute__((noinline)) static void one(const double *in, double *out) {{ kernel(in, out); }}
static double in[{MOTIONS} * 18], out[{MOTIONS} * 6];
int main(int n, char **names) {{
  FILE *file = fopen(names[1], \"rb\");
  if (n < 3 || !file || fread(in, sizeof in, 1, file) != 1) return 1;
  fclose(file);
  double least = 1e9;
  for (int round = 0; round < {ROUNDS}; round++) {{
    struct timespec start, end;
    clock_gettime(CLOCK_MONOTONIC, &start);
    for (int k = 0; k < {MOTIONS}; k++) one(in + 18 * k, out + 6 * k);
    clock_gettime(CLOCK_MONOTONIC, &end);
    const double took = (end.tv_sec - start.tv_sec) * 1e9 + (end.tv_nsec - start.tv_nsec);
    if (took < least) least = took;
  }}
  file = fopen(names[2], \"wb\");
  if (!file || fwrite(out, sizeof out, 1, file) != 1 || fclose(file)) return 1;
  printf(\"%f\\n\", least / {MOTIONS});
  return 0;
}}
"
    )
}

/// The committed controller's, whose constants are in its code as those of the C are.
#[inline(never)]
fn rust(motion: &Motion<f64>) -> [f64; 6] {
    PLATFORM.leg_forces(motion)
}

/// Least time of a motion, ns.
fn time_rust(motions: &[Motion<f64>], forces: &mut [[f64; 6]]) -> f64 {
    let round = |forces: &mut [[f64; 6]]| {
        let start = Instant::now();
        for (motion, force) in motions.iter().zip(forces) {
            *force = rust(motion);
        }
        start.elapsed().as_secs_f64() * 1e9 / motions.len() as f64
    };
    (0..ROUNDS).map(|_| round(forces)).fold(f64::INFINITY, f64::min)
}

fn bytes<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn built(folder: &Path, name: &str, arguments: &[&str]) -> Option<PathBuf> {
    let program = folder.join(name);
    let status =
        Command::new("cc").args(["-O3", "-o"]).arg(&program).args(arguments).arg(folder.join("kernel.c")).status();
    status.is_ok_and(|status| status.success()).then_some(program)
}

fn main() {
    let compiled = compile(&repository().join("specs/reference.toml")).expect("the reference spec compiles");
    let dynamics = &compiled.ir.dynamics;
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("kernel.c"), program(&traced(&dynamics.platform()))).expect("a file");
    let motions = motions(MOTIONS, 5e-5);
    let rows = motions.iter().flat_map(|m| [&m.pose, &m.rate, &m.acceleration]).flatten();
    std::fs::write(folder.join("in"), bytes(rows)).expect("a file");

    let mut forces = vec![[0.0; 6]; MOTIONS];
    let built = COMPILERS.map(|(name, arguments, _)| built(folder, &name.replace(['=', ' '], "-"), arguments));
    let mut least = [f64::INFINITY; 1 + COMPILERS.len()];
    for _ in 0..TURNS {
        least[0] = least[0].min(time_rust(&motions, &mut forces));
        for (k, ((name, _, same), program)) in COMPILERS.iter().zip(&built).enumerate() {
            let Some(program) = program else { continue };
            let output =
                Command::new(program).arg(folder.join("in")).arg(folder.join("out")).output().expect("it runs");
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            least[k + 1] = least[k + 1].min(text.trim().parse().expect("a time"));
            let equal = std::fs::read(folder.join("out")).expect("forces") == bytes(forces.iter().flatten());
            assert!(equal || !same, "{name}: other bits than the kernel's");
        }
    }
    let [kernel, c @ ..] = least;
    println!("h, h', h'' to six leg forces, reference platform, ns a motion (least of {} rounds):", TURNS * ROUNDS);
    println!("  {kernel:7.1}  the controller's kernel");
    for ((name, ..), time) in COMPILERS.iter().zip(c) {
        if time.is_finite() {
            println!("  {time:7.1}  traced C, cc -O3 {name}: kernel / C = {:.2}", kernel / time);
        } else {
            println!("  no figure: `cc -O3 {name}` does not work here");
        }
    }
}
