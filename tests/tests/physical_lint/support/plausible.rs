//! Platforms as they might be built: sizes, masses, stacks, electronics and rates that fit together.

use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::Path;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use specgen::everett::EverettTable;
use specgen::identify::write_table_csv;

struct RandomSource<'a>(&'a mut ChaCha8Rng);

impl RandomSource<'_> {
    fn unit(&mut self) -> f64 {
        f64::from(self.0.next_u32()) / f64::from(u32::MAX)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Evenly over the orders of magnitude.
    fn order(&mut self, low: f64, high: f64) -> f64 {
        (self.between(low.ln(), high.ln())).exp()
    }

    fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.0.next_u32() as usize % choices.len()]
    }
}

/// Rounded as people write: four digits.
fn digits(value: f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let scale = 10_f64.powf(3.0 - value.abs().log10().floor());
    (value * scale).round() / scale
}

fn list(values: &[f64], unit: &str) -> String {
    let items: Vec<String> = values.iter().map(|value| format!("\"{} {unit}\"", digits(*value))).collect();
    format!("[{}]", items.join(", "))
}

/// J = ∂l/∂h of the legs at rest, from the angles of the joints; and the shortest leg.
fn jacobian(base: f64, platform: f64, angles: [f64; 2], height: f64) -> ([[f64; 6]; 6], f64) {
    let third = TAU / 3.0;
    let mut rows = [[0.0; 6]; 6];
    let mut shortest = f64::INFINITY;
    for (leg, row) in rows.iter_mut().enumerate() {
        // Leg pairs meet on the base at 60°, 180°, 300° and on the platform at 0°, 120°, 240°.
        let pair = (leg / 2) as f64;
        let at_base = PI / 3.0 + third * pair + if leg % 2 == 0 { -0.5 } else { 0.5 } * angles[0];
        let at_platform =
            if leg % 2 == 0 { third * pair + 0.5 * angles[1] } else { third * (pair + 1.0) - 0.5 * angles[1] };
        let (b, p) = (
            [base * at_base.cos(), base * at_base.sin()],
            [platform * at_platform.cos(), platform * at_platform.sin()],
        );
        let leg = [p[0] - b[0], p[1] - b[1], height];
        let length = leg.iter().map(|x| x * x).sum::<f64>().sqrt();
        let s = leg.map(|x| x / length);
        *row = [s[0], s[1], s[2], p[1] * s[2], -p[0] * s[2], p[0] * s[1] - p[1] * s[0]];
        shortest = shortest.min(length);
    }
    (rows, shortest)
}

/// A table with a hysteresis of `width` of its displacement.
fn table(grid: usize, volts: [f64; 2], travel: f64, width: f64) -> EverettTable {
    let mut nodes = Vec::new();
    for up in 1..=grid {
        for down in 0..up {
            let part = (up - down) as f64 / grid as f64;
            nodes.push(travel * ((1.0 - width) * part + width * part * part));
        }
    }
    EverettTable { grid, drive_min: volts[0], drive_max: volts[1], nodes }
}

/// A spec in `folder`, with the table of its stacks beside it.
pub fn platform(random: &mut ChaCha8Rng, folder: &Path, index: usize) -> String {
    let mut draw = RandomSource(random);
    let control = index % 4 != 3;
    // Sizes, m.
    let radius = draw.order(0.03, 0.3);
    let base = radius * draw.between(1.1, 2.0);
    let height = base * draw.between(0.8, 1.5);
    let angles = [draw.between(0.03, 0.5), draw.between(0.03, 0.5)];
    let (jacobian, length) = jacobian(base, radius, angles, height);
    // A plate with something on it: aluminium to steel, a tenth to half as thick as wide.
    let thickness = radius * draw.between(0.1, 0.8);
    let mass = 2700.0 * draw.between(0.5, 2.5) * PI * radius * radius * thickness * 0.5;
    let across = mass * (radius * radius / 4.0 + thickness * thickness / 12.0) * draw.between(0.8, 2.0);
    let along = mass * radius * radius / 2.0 * draw.between(0.7, 1.1);
    let along = along.min(1.9 * across);
    // Leg parts: rods of a third to half of the leg.
    let part = [length * draw.between(0.3, 0.5), length * draw.between(0.3, 0.5)];
    let weight = [mass * draw.between(0.03, 0.2), mass * draw.between(0.03, 0.2)];
    let moment = |k: usize, extra: f64| weight[k] * part[k] * part[k] / 12.0 * extra;
    // Stacks: up to 0.12 % of the leg's length.
    let volts = draw.one_of(&[100.0, 120.0, 150.0]);
    let stacks = draw.one_of(&[1.0, 2.0, 3.0, 4.0, 5.0]);
    let stroke = (length * draw.between(0.2e-3, 0.8e-3)).max(8e-6);
    let gain = stroke / volts / stacks * draw.between(0.9, 1.15);
    // A first mode of some hundred hertz.
    let first = draw.order(150.0, 600.0);
    let stiffness = (TAU * first).powi(2) * (mass + 3.0 * weight[1]) / 6.0 * draw.between(2.0, 5.0);
    let own = (stiffness / (weight[1] + mass / 6.0)).sqrt() / TAU;
    let resonance = own * draw.between(0.6, 1.5);
    let period = draw.one_of(&[50.0, 100.0, 125.0]) * 1e-6;
    let slew = volts * resonance * draw.between(0.5, 2.0);
    let lag = draw.between(0.1, 2.0) * 0.2 * volts / slew;
    let lag = lag.min(4.0 * period).max(0.1 * period);
    let grid = draw.one_of(&[16, 24, 32]);
    let name = format!("leg-{index}.csv");
    let travel = gain * stacks * volts * draw.between(0.95, 1.15);
    fs::write(folder.join(&name), write_table_csv(&table(grid, [0.0, volts], travel, draw.between(0.05, 0.15))))
        .expect("written");
    // Where the legs reach, from the middle of the strokes; the bias goes near there.
    let usable = stroke.min(travel);
    let steepest: Vec<f64> =
        (0..6).map(|axis| jacobian.iter().map(|row| row[axis].abs()).fold(0.0, f64::max)).collect();
    let share = draw.between(0.5, 0.9);
    let reach: Vec<f64> = steepest.iter().map(|slope| 0.5 * usable / slope * share).collect();
    let lift = 0.5 * usable / steepest[2] * draw.between(0.8, 1.0);
    let [tx, ty] = [digits(reach[0]), digits(reach[1])];
    let tz = lift + 0.5 * usable / steepest[2] * draw.between(0.3, 0.9);
    let (workspace, turns) = ([tx, ty, tz], [reach[3], reach[4], reach[5]]);
    // Gauges on a radius, wide enough for what they see.
    let at = radius * draw.between(0.6, 0.95);
    let farthest = tx.max(ty).max(tz) + at * turns.iter().copied().fold(0.0, f64::max);
    let range = if control { [-1.5 * farthest, 1.5 * farthest] } else { [-0.1 * stroke, 1.2 * stroke] };
    let bits = draw.one_of(&[16, 18, 20]);
    let step = (range[1] - range[0]) / f64::from(1_u32 << bits);
    let noise = step * draw.order(0.5, 10.0);
    let um = 1e6;
    let [base_mm, platform_mm, base_angle] = [base * 1e3, radius * 1e3, angles[0].to_degrees()].map(digits);
    let [platform_angle, height_mm] = [angles[1].to_degrees(), height * 1e3].map(digits);
    let mut text = format!(
        "schema = 1\nname = \"plausible-{index}\"\n\n[geometry]\nbase_radius = \"{base_mm} mm\"\nplatform_radius = \"{platform_mm} mm\"\nbase_angle = \"{base_angle} deg\"\nplatform_angle = \"{platform_angle} deg\"\nheight = \"{height_mm} mm\"\n"
    );
    let grams = digits(mass * 1e3);
    let moments = list(&[across * 1e9, across * 1e9 * draw.between(0.9, 1.1), along * 1e9], "g mm^2");
    let [fixed, extensible] = [weight[0] * 1e3, weight[1] * 1e3].map(digits);
    let fixed_moment = digits(moment(0, draw.between(1.0, 1.5)) * 1e9);
    let [extensible_moment, fixed_centre] = [moment(1, draw.between(1.0, 1.5)) * 1e9, part[0] * 500.0].map(digits);
    let extensible_centre = digits(part[1] * 500.0);
    text += &format!(
        "\n[platform]\nmass = \"{grams} g\"\ninertia = {moments}\n\n[leg]\nfixed_mass = \"{fixed} g\"\nextensible_mass = \"{extensible} g\"\nfixed_inertia = \"{fixed_moment} g mm^2\"\nextensible_inertia = \"{extensible_moment} g mm^2\"\nfixed_center = \"{fixed_centre} mm\"\nextensible_center = \"{extensible_centre} mm\"\n"
    );
    let [per_volt, stroke_um, slew_rate, newtons] = [gain * 1e9, stroke * um, slew * 1e-3, stiffness].map(digits);
    let [hertz, damping] = [resonance, draw.between(0.05, 0.15)].map(digits);
    text += &format!(
        "\n[actuator]\nstacks = {stacks}\nstack_gain = \"{per_volt} nm/V\"\nstroke = \"{stroke_um} um\"\nvoltage = [\"0 V\", \"{volts} V\"]\nslew_rate = \"{slew_rate} V/ms\"\naxial_stiffness = \"{newtons} N/m\"\nresonance = \"{hertz} Hz\"\ndamping_ratio = {damping}\n"
    );
    let [lag_us, rms] = [lag * um, volts * draw.order(5e-6, 5e-5) * 1e3].map(digits);
    let (dac_bits, low) = (draw.one_of(&[16, 18, 20]), draw.one_of(&[0.0, -20.0]));
    let (high, spans) = (volts + draw.one_of(&[0.0, 20.0]), list(&range.map(|x| x * um), "um"));
    let noise_nm = digits(noise * 1e9);
    text += &format!(
        "\n[amplifier]\nlag = \"{lag_us} us\"\nnoise = \"{rms} mV\"\n\n[dac]\nbits = {dac_bits}\nrange = [\"{low} V\", \"{high} V\"]\n\n[sensor]\nrange = {spans}\nnoise = \"{noise_nm} nm\"\nbits = {bits}\n"
    );
    text += &format!("\n[hysteresis]\ngrid = {grid}\nmemory = {}\nrecords = [\"{name}\"]\n", draw.one_of(&[32, 64]));
    if control {
        let (mode, damping) = (draw.one_of(&["invhys", "ewma", "pcc"]), digits(draw.between(0.015, 0.05)));
        let [lead, bias] = [(lag * draw.between(0.0, 0.8)).max(0.1 * period) * um, lift * um].map(digits);
        text += &format!(
            "\n[adaptation]\nmode = \"{mode}\"\n\n[control]\nmodal_damping = {damping}\nlead = \"{lead} us\"\n\n[control.setpoint]\nbias = [\"0 um\", \"0 um\", \"{bias} um\", \"0 urad\", \"0 urad\", \"0 urad\"]\nSTREAM_SPEED\n"
        );
        let turn = draw.between(0.0, TAU);
        let place = |angle: f64| [at * (turn + angle).cos(), at * (turn + angle).sin()];
        let looks = [(0.0, 2), (TAU / 3.0, 2), (2.0 * TAU / 3.0, 2), (0.0, 1), (PI, 1), (PI / 2.0, 0)];
        for (angle, axis) in looks {
            let [x, y] = place(angle);
            let direction = match axis {
                2 => [0.0, 0.0, 1.0],
                1 => [-turn.sin(), turn.cos(), 0.0],
                _ => [turn.cos(), turn.sin(), 0.0],
            };
            text += &format!(
                "\n[[gauge]]\npoint = {}\ndirection = {direction:?}\n",
                list(&[x * 1e3, y * 1e3, height * 1e3], "mm")
            );
        }
        // A circle about the bias, as a table.
        let size = [0.2 * reach[0], 0.2 * reach[1]];
        let rows: Vec<String> = (0..100)
            .map(|k| {
                let phase = TAU * f64::from(k) / 100.0;
                format!("{},{}", size[0] * um * phase.cos(), size[1] * um * phase.sin())
            })
            .collect();
        fs::write(folder.join(format!("circle-{index}.csv")), format!("x_um,y_um\n{}\n", rows.join("\n")))
            .expect("written");
        let row = draw.one_of(&[1.0, 2.0, 5.0, 10.0]);
        text += &format!(
            "\n[[trajectory]]\nname = \"circle\"\nkind = \"waveform\"\nfile = \"circle-{index}.csv\"\nperiod = \"{row} ms\"\nrepeat = true\n"
        );
        // Whoever declares a fast path lets it pass.
        let fastest = size.map(|size| 1.1 * TAU / 100.0 * size * um / row);
        let [x, y] = fastest.map(|speed| digits(speed.max(1.0)));
        text = text.replace(
            "STREAM_SPEED",
            &format!(
                "stream_speed = [\"{x} mm/s\", \"{y} mm/s\", \"1 mm/s\", \"10 mrad/s\", \"10 mrad/s\", \"10 mrad/s\"]"
            ),
        );
    } else {
        // A bandwidth well below what a resonance of 5 % damping stands.
        let weight = TAU * resonance * period * 0.05 * draw.between(0.2, 0.6);
        text += &format!("\n[adaptation]\nmode = \"ewma\"\nlevel_weight = {}\n", digits(weight));
    }
    let (us, translation) = (period * um, list(&workspace.map(|x| x * um), "um"));
    let (rotation, scalar) = (list(&turns.map(|x| x * 1e3), "mrad"), draw.one_of(&["f64", "f32"]));
    text += &format!(
        "\n[timing]\nperiod = \"{us} us\"\n\n[workspace]\ntranslation = {translation}\nrotation = {rotation}\n\n[controller]\nscalar = \"{scalar}\"\n"
    );
    text += "\n[target.budget]\nflash = \"128 KiB\"\nram = \"32 KiB\"\n";
    text
}
