//! Writes SVG text.

/// How a patch is filled.
#[derive(Clone, Copy)]
pub(super) enum Hatch {
    Lines,
    /// From 0 (white) to 1 (dark).
    Shade(f64),
}

/// A picture being written.
pub(super) struct Canvas {
    text: String,
}

impl Canvas {
    pub(super) fn new(width: f64, height: f64) -> Self {
        let mut text = String::new();
        text += &format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\">\n"
        );
        text += "<defs><pattern id=\"hatch\" width=\"7\" height=\"7\" patternTransform=\"rotate(45)\" patternUnits=\"userSpaceOnUse\"><rect width=\"7\" height=\"7\" fill=\"#fff4e5\"/><path d=\"M0 0V7\" stroke=\"#d9730d\" stroke-width=\"2.4\"/></pattern></defs>\n";
        text += &format!("<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n");
        Self { text }
    }

    pub(super) fn text(&mut self, x: f64, y: f64, size: f64, anchor: &str, color: &str, text: &str) {
        self.text += &format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{color}\">{}</text>\n",
            escaped(text)
        );
    }

    /// Vertical text, centred at its position.
    pub(super) fn upright(&mut self, x: f64, y: f64, size: f64, text: &str) {
        self.text += &format!(
            "<text transform=\"translate({x:.1} {y:.1}) rotate(-90)\" font-size=\"{size}\" text-anchor=\"middle\" fill=\"#222\">{}</text>\n",
            escaped(text)
        );
    }

    pub(super) fn clip(&mut self, id: usize, [x, y, w, h]: [f64; 4]) {
        self.text += &format!(
            "<clipPath id=\"panel{id}\"><rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\"/></clipPath>\n"
        );
    }

    pub(super) fn open_clipped(&mut self, id: usize) {
        self.text += &format!("<g clip-path=\"url(#panel{id})\">\n");
    }

    pub(super) fn close(&mut self) {
        self.text.push_str("</g>\n");
    }

    pub(super) fn frame(&mut self, [x, y, w, h]: [f64; 4]) {
        self.text += &format!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"none\" stroke=\"#333\"/>\n"
        );
    }

    /// A grid line.
    pub(super) fn rule(&mut self, a: [f64; 2], b: [f64; 2]) {
        self.text += &format!(
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"#000\" stroke-opacity=\"0.12\"/>\n",
            a[0], a[1], b[0], b[1]
        );
    }

    /// A polyline; non-finite points interrupt it.
    pub(super) fn line(&mut self, points: &[[f64; 2]], color: &str, width: f64, dashed: bool) {
        let mut path = String::new();
        let mut pen = 'M';
        for p in points {
            if p[0].is_finite() && p[1].is_finite() {
                path += &format!("{pen}{:.1} {:.1}", p[0], p[1]);
                pen = 'L';
            } else {
                pen = 'M';
            }
        }
        if path.is_empty() {
            return;
        }
        let dash = if dashed { " stroke-dasharray=\"7 4\"" } else { "" };
        self.text += &format!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}/>\n"
        );
    }

    pub(super) fn dots(&mut self, points: &[[f64; 2]], color: &str, radius: f64) {
        let mut path = String::new();
        for p in points.iter().filter(|p| p[0].is_finite() && p[1].is_finite()) {
            // A zero-length line with round ends is a dot; thousands of them form one element.
            path += &format!("M{:.1} {:.1}h0", p[0], p[1]);
        }
        if !path.is_empty() {
            self.text += &format!(
                "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{}\" stroke-linecap=\"round\"/>\n",
                2.0 * radius
            );
        }
    }

    pub(super) fn patch(&mut self, [x, y, w, h]: [f64; 4], fill: Hatch) {
        let fill = match fill {
            Hatch::Lines => "url(#hatch)".to_owned(),
            Hatch::Shade(shade) => {
                let part = |full: f64| (255.0 - shade.clamp(0.0, 1.0) * full) as u8;
                format!("rgb({},{},{})", part(224.0), part(160.0), part(87.0))
            }
        };
        self.text += &format!("<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" fill=\"{fill}\"/>\n");
    }

    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

/// Escapes the four special characters of XML and HTML.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
