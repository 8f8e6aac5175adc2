//! `src/integrity.rs`: the settings at start-up as words, and whether tables and settings are still those that were compiled.
//! Reads [`ir::Integrity`](crate::ir::Integrity).

use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{Ir, Path, RateModel};

pub fn emit(ir: &Ir) -> TokenStream {
    let settings = ir.integrity.settings.iter().map(|word| hex(*word));
    let crc = hex(u64::from(ir.integrity.crc));
    let (identity, length) = (&ir.integrity.identity, literal::count(ir.integrity.identity.len()));
    let identity = Literal::byte_string(identity.as_bytes());
    let tables = tables(ir);
    let trajectories = Trajectories::of(ir);
    let (paths, helpers, names) = (trajectories.steps, trajectories.helpers, trajectories.names);
    let setpoint_imports = (!names.is_empty()).then(|| quote! { use specgen_runtime::setpoint::{#(#names),*}; });
    let (real, setpoint) =
        if names.is_empty() { (None, None) } else { (Some(quote! { Real, }), Some(quote! { , setpoint })) };
    quote! {
        #![doc = " Whether tables and settings in memory are still those that the compiler wrote."]
        #![doc = ""]
        #![doc = " Everything is read through `black_box`, so that memory is looked at and not what the compiler remembers."]

        use core::hint::black_box;

        use specgen_runtime::Crc32;
        #setpoint_imports

        use crate::{CONFIG_WORDS, Config, #real hysteresis #setpoint};

        /// CRC-32 (ISO-HDLC) of [`IDENTITY`], the tables, the trajectories and [`SETTINGS`]; computed by specgen.
        pub const CRC: u32 = #crc;

        /// The spec's settings, in the order of [`crate::CONFIG_NAMES`]: what `Config::new().to_words()` gives.
        pub static SETTINGS: [u64; CONFIG_WORDS] = [#(#settings),*];

        /// The spec's settings as they lie in memory, which [`intact`] speaks for: what a target starts with. Words that no
        /// `Config` can hold give `Config::new()`; then [`intact`] is false.
        #[must_use]
        pub fn config() -> Config {
            Config::from_words(black_box(&SETTINGS)).unwrap_or_default()
        }

        /// Where this controller comes from, in one line. It lies in every image whose target asks [`intact`], and
        /// `specgen size` prints it.
        pub static IDENTITY: [u8; #length] = *#identity;

        /// CRC-32 of identity, tables, trajectories and settings as they are in memory now.
        #[must_use]
        pub fn computed() -> u32 {
            let mut crc = Crc32::new();
            crc.bytes(black_box(&IDENTITY));
            #(#tables)*
            #(#paths)*
            crc.words(black_box(&SETTINGS));
            crc.finish()
        }

        /// Nothing has changed since the compiler wrote it. A target asks once, before it lets the amplifiers on.
        #[must_use]
        pub fn intact() -> bool {
            computed() == black_box(CRC)
        }

        #(#helpers)*
    }
}

/// A word in hexadecimal.
fn hex(word: u64) -> Literal {
    match format!("{word:#x}").parse() {
        Ok(literal) => literal,
        // Digits after 0x are a literal.
        Err(_) => unreachable!("{word:#x} is no literal"),
    }
}

/// Statements that add the tables of the hysteresis.
fn tables(ir: &Ir) -> Vec<TokenStream> {
    let h = &ir.hysteresis;
    let reals = |prefix: &str, count: usize| -> Vec<TokenStream> {
        let names = (0..count).map(|k| format_ident!("{prefix}_{k}"));
        names.map(|name| quote! { crc.reals(black_box(&hysteresis::#name)); }).collect()
    };
    let mut steps = reals("EVERETT", h.tables.len());
    match &h.rate {
        None => {}
        Some(RateModel::DynamicPreisach { tables, .. }) => steps.extend(reals("RATE", tables.len())),
        Some(RateModel::Creep { .. }) => steps.push(quote! {
            let creep = black_box(&hysteresis::CREEP_OF_LEGS);
            crc.reals(&creep.gains);
            crc.reals(&creep.weights);
            crc.reals(&creep.carried);
            crc.reals(&[creep.direct]);
        }),
    }
    steps
}

/// What adds the trajectories of a platform.
#[derive(Default)]
struct Trajectories {
    steps: Vec<TokenStream>,
    helpers: Vec<TokenStream>,
    /// Types to import.
    names: Vec<TokenStream>,
}

impl Trajectories {
    fn of(ir: &Ir) -> Self {
        let mut all = Self::default();
        let paths = ir.task_space.iter().flat_map(|task| &task.setpoints.trajectories);
        let (mut in_rows, mut in_segments) = (false, false);
        for (index, trajectory) in paths.enumerate() {
            match &trajectory.path {
                Path::Segments { .. } => {
                    let name = format_ident!("SEGMENTS_{index}");
                    all.steps.push(quote! { add_segments(&mut crc, black_box(&setpoint::#name)); });
                    in_segments = true;
                }
                Path::Table { .. } => {
                    let name = format_ident!("ROWS_{index}");
                    all.steps.push(quote! { add_rows(&mut crc, black_box(&setpoint::#name)); });
                    in_rows = true;
                }
            }
        }
        if in_rows {
            all.names.push(quote! { Row });
            all.helpers.push(quote! {
                /// Adds the rows of a table.
                fn add_rows(crc: &mut Crc32, rows: &[Row<Real>]) {
                    for row in rows {
                        crc.reals(&row.pose);
                        crc.reals(&row.bend);
                    }
                }
            });
        }
        if in_segments {
            all.names.push(quote! { Segment });
            all.helpers.push(quote! {
                /// Adds the pieces of a path.
                fn add_segments(crc: &mut Crc32, segments: &[Segment<Real>]) {
                    for segment in segments {
                        crc.words(&[segment.first as u32 as u64, segment.phase, segment.phase_step]);
                        crc.reals(&[segment.per_tick, segment.per_second, segment.angular]);
                        for axis in &segment.axes {
                            crc.reals(&[axis.place, axis.slope]);
                            crc.reals(&axis.sine);
                            crc.reals(&axis.cosine);
                        }
                    }
                }
            });
        }
        all
    }
}
