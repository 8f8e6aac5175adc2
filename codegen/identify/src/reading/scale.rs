//! Scale and offset of a column, as in `CH2*5 um/V+0.3 um`.

use crate::columns::names::{Conversion, Quantity};

/// A scaled column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scaled {
    /// Its name, or its number from 1.
    pub(crate) column: String,
    /// To the unit of the quantity.
    pub(crate) conversion: Conversion,
    /// Number of the factor's units in one of the quantity's.
    pub(crate) per: f64,
    /// The column's unit, such as the V of um/V.
    pub(crate) denominator: Option<String>,
}

/// The scale in `text`; none if there is neither a factor nor an offset. `per`: of the unit in the quantity's name, which
/// a number without unit has.
///
/// # Errors
/// The expected form.
pub(super) fn parse(text: &str, quantity: &Quantity, per: Option<f64>) -> Result<Option<Scaled>, String> {
    let expected = |what: &str| {
        let example = format!("{}=CH2*5 {}/V", quantity.plain(), quantity.unit());
        Err(format!("`{text}`: expected {what}, such as `{example}`"))
    };
    let (column, factor, rest) = match text.rsplit_once('*') {
        Some((column, scale)) => {
            let Some((factor, rest)) = number(scale) else { return expected("a factor behind `*`") };
            (column, factor, rest)
        }
        None => match offset(text, quantity) {
            Some(at) => (&text[..at], 1.0, &text[at..]),
            None => return Ok(None),
        },
    };
    let (unit, offset) = rest.find(['+', '-']).map_or((rest, ""), |at| rest.split_at(at));
    // A rate has a slash of its own.
    let mut slashes = unit.match_indices('/').map(|(at, _)| at);
    let at = slashes.clone().find(|at| quantity.per(&unit[..*at]).is_some()).or_else(|| slashes.next());
    let (unit, denominator) = match at.filter(|_| quantity.per(unit).is_none()) {
        Some(at) => (&unit[..at], Some(&unit[at + 1..])),
        None => (unit, None),
    };
    let size = |unit: &str| if unit.trim().is_empty() { per } else { quantity.per(unit) };
    let offset = if offset.is_empty() { Some((0.0, "")) } else { number(offset) };
    let Some((offset, offset_unit)) = offset else { return expected("a number behind the sign of the offset") };
    // An offset without unit has that of the factor. Without a factor and a unit in the name it is the other way round.
    let unit = if unit.trim().is_empty() && per.is_none() { offset_unit } else { unit };
    let (Some(factor_per), Some(offset_per)) =
        (size(unit), size(if offset_unit.trim().is_empty() { unit } else { offset_unit }))
    else {
        return expected(&format!("a unit of `{}`", quantity.plain()));
    };
    if column.trim().is_empty() || !factor.is_finite() || factor == 0.0 || !offset.is_finite() {
        return expected("a column and a factor other than 0");
    }
    Ok(Some(Scaled {
        column: column.trim().to_owned(),
        conversion: Conversion { per: 1.0, scale: Some([factor / factor_per, offset / offset_per]) },
        per: factor_per,
        denominator: denominator.map(|unit| unit.trim().to_owned()),
    }))
}

/// Place of the sign of an offset: the first with a number and a unit behind it, or else the last with a number.
fn offset(text: &str, quantity: &Quantity) -> Option<usize> {
    let rest = |at: &usize| number(&text[*at..]).map(|(_, rest)| rest.trim());
    let is_whole = |rest: &str| rest.is_empty() || quantity.per(rest).is_some();
    let mut signs = text.match_indices(['+', '-']).map(|(at, _)| at);
    signs.find(|at| rest(at).is_some_and(is_whole)).or_else(|| text.rfind(['+', '-']).filter(|at| rest(at).is_some()))
}

/// The number at the beginning of a text, and the rest. Blanks may follow its sign.
fn number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim_start();
    if let Some(rest) = text.strip_prefix(['+', '-']).filter(|rest| rest.starts_with(' ')) {
        let (size, rest) = number(rest).filter(|_| !rest.trim_start().starts_with(['+', '-']))?;
        return Some((if text.starts_with('-') { -size } else { size }, rest));
    }
    let end = text.find(|c: char| !matches!(c, '0'..='9' | '+' | '-' | '.' | 'e' | 'E')).unwrap_or(text.len());
    (1..=end).rev().find_map(|end| Some((text[..end].parse().ok()?, &text[end..])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::names::quantity;

    #[test]
    fn a_factor_and_an_offset_have_units() {
        let displacement = quantity("displacement_um").unwrap();
        for (text, per, column, scale, denominator) in [
            ("CH2*5 um/V", None, "CH2", [5.0, 0.0], Some("V")),
            ("CH2 * 5um/V + 0.3 um", None, "CH2", [5.0, 0.3], Some("V")),
            ("2*-5e-3 mm/V-300 nm", None, "2", [-5.0, -0.3], Some("V")),
            ("CH2+300 nm", Some(1.0), "CH2", [1.0, 0.3], None),
            ("CH2-5e-3 mm", Some(1.0), "CH2", [1.0, -5.0], None),
            ("CH-2-5e-3 mm", Some(1.0), "CH-2", [1.0, -5.0], None),
            ("CH2*2+1", Some(1e3), "CH2", [2e-3, 1e-3], None),
            ("a*b*2", Some(1.0), "a*b", [2.0, 0.0], None),
        ] {
            let found = parse(text, displacement, per).unwrap().unwrap();
            let [factor, offset] = found.conversion.scale.unwrap();
            assert!((factor - scale[0]).abs() < 1e-12 && (offset - scale[1]).abs() < 1e-12, "{text}: {found:?}");
            assert_eq!((found.column.as_str(), found.denominator.as_deref()), (column, denominator), "{text}");
        }
        let rate = parse("7*-2 mm/s/V", quantity("vx_um/s").unwrap(), None).unwrap().unwrap();
        assert_eq!((rate.conversion.scale, rate.denominator.as_deref()), (Some([-2e3, 0.0]), Some("V")));
        assert_eq!(parse("Voltage (Filtered)", displacement, Some(1.0)), Ok(None));
        for bad in ["CH2*", "CH2*5", "CH2*5 V", "CH2*0 um", "*5 um", "CH2*5 um+x"] {
            assert!(parse(bad, displacement, None).is_err(), "{bad}");
        }
    }
}
