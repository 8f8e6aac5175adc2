//! Slips as people make them: a unit off by a thousand, a sign, two values in each other's place, a stroke that no stack
//! has, weights and gains that no loop stands.

/// One slip.
#[derive(Debug, Clone)]
pub struct Mutant {
    /// The kind of slip.
    pub kind: &'static str,
    /// Key path of the value, as findings name it, with the index of a list's item.
    pub key: String,
    /// What was written, and what is written now.
    pub change: String,
    pub text: String,
}

/// A number in the text: its place, what follows it, and the key it belongs to.
pub struct Value {
    pub start: usize,
    pub end: usize,
    pub number: f64,
    /// Text between the number and the closing quote; none for a bare number.
    pub unit: Option<String>,
    pub key: String,
    /// Which value of its key.
    item: usize,
    pub of: usize,
}

/// Every number of a spec, in the order of the file.
pub fn values(text: &str) -> Vec<Value> {
    let mut found = Vec::new();
    let mut section = String::new();
    let mut tables: Vec<(String, usize)> = Vec::new();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let begin = at;
        at += line.len();
        let code = line.split('#').next().unwrap_or("");
        let trimmed = code.trim();
        if let Some(name) = trimmed.strip_prefix("[[").and_then(|rest| rest.strip_suffix("]]")) {
            let count = tables.iter().filter(|(other, _)| other == name).count();
            tables.push((name.to_owned(), count));
            section = format!("{name}[{count}]");
            continue;
        }
        if let Some(name) = trimmed.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            name.clone_into(&mut section);
            continue;
        }
        let Some((key, _)) = code.split_once('=') else { continue };
        let offset = begin + key.len() + 1;
        let path = if section.is_empty() { key.trim().to_owned() } else { format!("{section}.{}", key.trim()) };
        if section.is_empty() {
            continue;
        }
        let first = found.len();
        numbers(&code[key.len() + 1..], offset, &path, &mut found);
        let of = found.len() - first;
        for (item, value) in found[first..].iter_mut().enumerate() {
            (value.item, value.of) = (item, of);
        }
    }
    found
}

fn numbers(code: &str, offset: usize, key: &str, found: &mut Vec<Value>) {
    let bytes = code.as_bytes();
    let mut k = 0;
    let mut quoted = false;
    while k < bytes.len() {
        if bytes[k] == b'"' {
            quoted = !quoted;
            k += 1;
            continue;
        }
        let before = if k == 0 { b' ' } else { bytes[k - 1] };
        let starts =
            bytes[k].is_ascii_digit() || (bytes[k] == b'-' && bytes.get(k + 1).is_some_and(u8::is_ascii_digit));
        let fits = if quoted { before == b'"' } else { matches!(before, b' ' | b'[' | b',') };
        if !(starts && fits) {
            k += 1;
            continue;
        }
        let end = k + code[k..].find(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c))).unwrap_or(code.len() - k);
        if let Ok(number) = code[k..end].parse() {
            let rest = quoted.then(|| code[end..].split('"').next().unwrap_or("").to_owned());
            // A file name or a formula is no number.
            if rest.as_ref().is_none_or(|unit| unit.starts_with(' ')) {
                found.push(Value {
                    start: offset + k,
                    end: offset + end,
                    number,
                    unit: rest,
                    key: key.to_owned(),
                    item: 0,
                    of: 1,
                });
            }
        }
        k = end;
    }
}

impl Value {
    /// With the index of a list's item.
    pub fn path(&self) -> String {
        if self.of > 1 { format!("{}[{}]", self.key, self.item) } else { self.key.clone() }
    }

    fn replaced(&self, text: &str, number: &str, kind: &'static str) -> Mutant {
        let unit = self.unit.clone().unwrap_or_default();
        Mutant {
            kind,
            key: self.path(),
            change: format!("{}{unit} -> {number}{unit}", &text[self.start..self.end]),
            text: format!("{}{number}{}", &text[..self.start], &text[self.end..]),
        }
    }
}

/// A number as people write it.
pub fn shown(number: f64) -> String {
    let plain = format!("{number}");
    if plain.len() < 12 { plain } else { format!("{number:e}") }
}

/// Every slip of every kind that changes the meaning of `text`.
pub fn all(text: &str) -> Vec<Mutant> {
    let values = values(text);
    let mut mutants = Vec::new();
    for value in values.iter().filter(|value| value.number != 0.0) {
        if value.unit.is_some() {
            for factor in [1e3, 1e-3] {
                // As decimal arithmetic would have it, not with the rounding of a product.
                let number = if factor > 1.0 { value.number * 1000.0 } else { value.number / 1000.0 };
                mutants.push(value.replaced(text, &shown(number), "unit off by 1000"));
            }
        }
        mutants.push(value.replaced(text, &shown(-value.number), "sign"));
    }
    for (k, a) in values.iter().enumerate() {
        // Values of one key and one unit, or of two keys that are easily taken for each other.
        for b in &values[k + 1..] {
            let listed = a.key == b.key && a.unit == b.unit && a.of <= 6;
            // Rotations in each other's place, or translations: not the one for the other.
            let twins =
                [("geometry.base_radius", "geometry.platform_radius"), ("actuator.stroke", "actuator.stack_gain")];
            let pair = twins.contains(&(a.key.as_str(), b.key.as_str()));
            if (listed || pair) && a.number != b.number {
                let (x, y) = (&text[a.start..a.end], &text[b.start..b.end]);
                mutants.push(Mutant {
                    kind: "swapped",
                    key: a.key.clone(),
                    change: format!("{x} <-> {y} (items {} and {})", a.item, b.item),
                    text: format!("{}{y}{}{x}{}", &text[..a.start], &text[a.end..b.start], &text[b.end..]),
                });
            }
        }
    }
    for value in &values {
        let factors: &[f64] = match value.key.as_str() {
            "actuator.stroke" => &[0.03, 0.1, 0.3, 3.0, 10.0, 30.0, 100.0],
            "actuator.stacks" => &[5.0, 10.0, 20.0],
            "actuator.stack_gain" => &[0.1, 0.2, 5.0, 10.0],
            "actuator.voltage" => &[0.1, 10.0],
            "workspace.translation" | "workspace.rotation" => &[2.0, 5.0, 20.0, 100.0],
            "control.setpoint.bias" => &[-1.0, 20.0, 100.0],
            _ => &[],
        };
        for factor in factors.iter().filter(|_| value.number != 0.0) {
            mutants.push(value.replaced(text, &shown(value.number * factor), "impossible stroke"));
        }
        let weights: &[f64] = match value.key.rsplit('.').next().unwrap_or("") {
            "level_bandwidth" | "drift_bandwidth" => &[50.0, 100.0, 300.0, 1000.0],
            "proportional" | "integral"
                if value.key.starts_with("gains") || value.key.starts_with("position_gains") =>
            {
                &[100.0, 1000.0, 1e5]
            }
            _ => &[],
        };
        for factor in weights.iter().filter(|_| value.number != 0.0) {
            mutants.push(value.replaced(text, &shown(value.number * factor), "unstable weight"));
        }
        let absolute: &[&str] = match value.key.as_str() {
            "adaptation.gain_ratio" if value.item == 1 => &["6", "9", "10"],
            "adaptation.level_weight" => &["2", "5", "1.5"],
            "adaptation.drift_weight" => &["2", "3", "1.2"],
            _ => &[],
        };
        for number in absolute {
            mutants.push(value.replaced(text, number, "unstable weight"));
        }
    }
    mutants
}
