//! What the spec asks of converter and microcontroller: refused with a fix, and the fix put into the spec is accepted.

use specgen::diagnostic::{Code, Diagnostic, Place, codes};
use specgen::lower::leg_jacobian;
use specgen::requirements::{Steps, steps};
use specgen_tests::{compile_text, edited, length, worse};

/// The spec with edits, and what the compiler says.
fn verdict(spec: &str, edits: &[(&str, &str)]) -> (String, Result<Steps, Vec<Diagnostic>>) {
    let text = edited(spec, edits);
    let found = compile_text(&text).map(|compiled| steps(&compiled.model));
    (text, found)
}

fn finding(findings: &[Diagnostic], code: Code) -> &Diagnostic {
    findings.iter().find(|finding| finding.code == code).unwrap_or_else(|| panic!("no {} in {findings:#?}", code.id))
}

/// The first text between quotes after `marker`.
fn quoted<'a>(help: &'a str, marker: &str) -> &'a str {
    help.split_once(marker).and_then(|(_, rest)| rest.split('"').nth(1)).unwrap_or_else(|| panic!("{marker}: {help}"))
}

#[test]
fn a_converter_too_coarse_is_refused_with_the_bits_that_would_do() {
    for spec in ["reference.toml", "legs.toml"].into_iter().take(length(1, 2)) {
        let (_, good) = verdict(spec, &[]);
        let found = good.unwrap();
        // 150 V in 65,535 codes through 5 × 0.1262 µm/V.
        assert!((found.leg - 150.0 / 65_535.0 * 0.631e-6).abs() < 1e-15, "{found:?}");
        let largest = found.platform.iter().fold(found.leg, |most, step| if *step > most { *step } else { most });
        println!("{spec}: {found:?}");
        // Just met, just missed.
        let asking = |nanometres: f64| format!("[requirements]\nprecision = \"{nanometres} nm\"\n\n[timing]");
        let (_, met) = verdict(spec, &[("[timing]", &asking(largest * 1e9 * (1.0 + 1e-9)))]);
        assert!(met.is_ok(), "{met:?}");
        let factors = [(0.999, 17), (0.26, 18), (0.1, 20)];
        for &(factor, bits) in &factors[..length(1, factors.len())] {
            let missed = asking(largest * 1e9 * factor);
            let (text, refused) = verdict(spec, &[("[timing]", &missed)]);
            let findings = refused.unwrap_err();
            let one = finding(&findings, codes::TOO_FEW_BITS);
            let Place::Spec(span) = &one.place else { panic!("{one:?}") };
            assert!(text[span.clone()].contains("nm") && one.key == "requirements.precision", "{one:?}");
            assert!(one.help.contains(&format!("dac.bits = {bits} is enough")), "{factor}: {}", one.help);
            // The bits that are named do, one fewer does not; so does the precision that is named.
            for (bits, good) in [(bits, true), (bits - 1, false)] {
                let dac = format!("[dac]\nbits  = {bits}");
                let (_, again) = verdict(spec, &[("[timing]", &missed), ("[dac]\nbits  = 16", &dac)]);
                let coarse = again.is_err_and(|found| found.iter().any(|f| f.code == codes::TOO_FEW_BITS));
                assert_eq!(coarse, !good, "{bits} bits");
            }
            let allowed = asking(quoted(&one.help, "allow ").trim_end_matches(" nm").parse().unwrap());
            let (_, accepted) = verdict(spec, &[("[timing]", &allowed)]);
            assert!(accepted.is_ok(), "{} is not accepted: {accepted:?}", allowed);
        }
    }
    let (_, hopeless) = verdict("legs.toml", &[("[timing]", "[requirements]\nprecision = \"0.001 nm\"\n\n[timing]")]);
    let findings = hopeless.unwrap_err();
    assert!(finding(&findings, codes::TOO_FEW_BITS).help.contains("no supported converter"), "{findings:?}");
}

/// The platform's step by brute force: every combination of half codes up or down, through the solved linear equations.
#[test]
fn the_step_of_the_platform_is_the_worst_of_all_roundings() {
    let compiled = compile_text(&edited("reference.toml", &[])).unwrap();
    let found = steps(&compiled.model);
    let jacobian = nalgebra::Matrix6::from_fn(|i, j| leg_jacobian(&compiled.model.geometry).unwrap()[i][j]);
    let solved = jacobian.lu();
    let mut worst = [0.0_f64; 3];
    for signs in 0..64_u32 {
        let legs =
            nalgebra::Vector6::from_fn(|leg, _| if signs >> leg & 1 == 1 { found.leg } else { -found.leg } / 2.0);
        let pose = solved.solve(&legs).unwrap();
        for (most, step) in worst.iter_mut().zip(pose.iter()) {
            *most = worse(*most, step.abs());
        }
    }
    for (found, worst) in found.platform.iter().zip(worst) {
        assert!((found / worst - 1.0).abs() < 1e-9, "{found} {worst}");
    }
}

#[test]
fn microcontrollers_that_do_not_fit_are_refused_with_a_fix_that_is_accepted() {
    let mcu = "mcu = \"mps2-an500\"";
    let parts = [("stm32f446re", 512, 128), ("mps2-an386", 4096, 4096)];
    for &(part, flash, ram) in &parts[..length(1, parts.len())] {
        let single = format!("mcu = \"{part}\"");
        let (text, refused) = verdict("legs.toml", &[(mcu, &single)]);
        let findings = refused.unwrap_err();
        let one = finding(&findings, codes::SCALAR_WITHOUT_FPU);
        let Place::Spec(span) = &one.place else { panic!("{one:?}") };
        assert_eq!(&text[span.clone()], format!("\"{part}\""));
        // Both fixes.
        let scalar = format!("scalar   = \"{}\"", quoted(&one.help, "scalar = "));
        let (_, first) = verdict("legs.toml", &[(mcu, &single), ("scalar   = \"f64\"", &scalar)]);
        assert!(first.is_ok(), "{first:?}");
        for other in ["mps2-an500", "stm32h743zi"] {
            assert!(one.help.contains(other), "{}", one.help);
            let (_, second) = verdict("legs.toml", &[(mcu, &format!("mcu = \"{other}\""))]);
            assert!(second.is_ok(), "{second:?}");
        }
        // A byte more than the part has.
        for (key, has) in [("flash        = \"128 KiB\"", flash), ("ram          = \"32 KiB\"", ram)] {
            let name = key.split(' ').next().unwrap();
            let edits = |bytes: u64| {
                let budget = format!("{name} = \"{bytes} B\"");
                let edits = [(mcu, single.as_str()), ("scalar   = \"f64\"", &scalar), (key, &budget)];
                verdict("legs.toml", &edits).1
            };
            assert!(edits(has * 1024).is_ok());
            let findings = edits(has * 1024 + 1).unwrap_err();
            let one = finding(&findings, codes::BUDGET_BEYOND_PART);
            assert_eq!(quoted(&one.help, "at most "), format!("{has} KiB"));
        }
    }
}
