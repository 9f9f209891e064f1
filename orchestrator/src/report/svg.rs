//! Drawing primitives: text that is safe in HTML, scales, axes.

use std::fmt::Write;

/// Text with the characters escaped that mean something in HTML.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c => safe.push(c),
        }
    }
    safe
}

/// A linear map from values to places on the page.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    from: (f64, f64),
    to: (f64, f64),
}

impl Scale {
    /// Maps `from.0` to `to.0` and `from.1` to `to.1`. An empty or meaningless range is widened.
    pub fn new(from: (f64, f64), to: (f64, f64)) -> Scale {
        let ordered = from.0.is_finite() && from.1.is_finite() && from.1 > from.0;
        let center = if from.0.is_finite() { from.0 } else { 0.0 };
        Scale { from: if ordered { from } else { (center - 0.5, center + 0.5) }, to }
    }

    /// The place of a value.
    pub fn at(&self, value: f64) -> f64 {
        self.to.0 + (value - self.from.0) / (self.from.1 - self.from.0) * (self.to.1 - self.to.0)
    }

    /// Round values inside the range, about `n` of them.
    pub fn ticks(&self, n: usize) -> Vec<f64> {
        let rough = (self.from.1 - self.from.0) / n.max(1) as f64;
        let power = 10_f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .map(|m| m * power)
            .into_iter()
            .find(|s| *s >= rough)
            .unwrap_or(10.0 * power);
        let (first, last) = ((self.from.0 / step).ceil(), (self.from.1 / step).floor());
        let mut ticks = Vec::new();
        let mut k = first;
        while k <= last && ticks.len() < 100 {
            // Adding 0 turns −0 into 0.
            ticks.push(k * step + 0.0);
            k += 1.0;
        }
        ticks
    }
}

/// A number for an SVG attribute: two decimals are a hundredth of a pixel.
pub fn place(value: f64) -> String {
    let text = format!("{value:.2}");
    match text.trim_end_matches('0').trim_end_matches('.') {
        "-0" => "0".into(),
        short => short.into(),
    }
}

/// `x,y x,y …` of an SVG polyline.
pub fn points(places: impl IntoIterator<Item = (f64, f64)>) -> String {
    let mut text = String::new();
    for (x, y) in places {
        if !text.is_empty() {
            text.push(' ');
        }
        // Writing to a string does not fail.
        let _ = write!(text, "{},{}", place(x), place(y));
    }
    text
}

/// A label of an axis tick: short, without needless zeros.
pub fn tick_label(value: f64) -> String {
    let text = format!("{value:.6}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_leave_its_element() {
        assert_eq!(escaped("<a href=\"x\">'&"), "&lt;a href=&quot;x&quot;&gt;&#39;&amp;");
    }

    #[test]
    fn scales_map_ends_and_survive_empty_ranges() {
        let scale = Scale::new((-1.0, 3.0), (100.0, 0.0));
        assert_eq!((scale.at(-1.0), scale.at(3.0), scale.at(1.0)), (100.0, 0.0, 50.0));
        assert!(Scale::new((2.0, 2.0), (0.0, 10.0)).at(2.0) == 5.0);
        assert!(Scale::new((f64::NAN, 1.0), (0.0, 10.0)).at(0.0).is_finite());
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(Scale::new((-0.055, 0.0), (0.0, 1.0)).ticks(3), [-0.04, -0.02, 0.0]);
        assert_eq!(Scale::new((0.0, 17.4), (0.0, 1.0)).ticks(4), [0.0, 5.0, 10.0, 15.0]);
    }

    #[test]
    fn places_are_short() {
        assert_eq!(points([(1.0, 2.5), (-0.001, 1.0 / 3.0)]), "1,2.5 0,0.33");
        assert_eq!(tick_label(-0.04), "−0.04");
    }
}
