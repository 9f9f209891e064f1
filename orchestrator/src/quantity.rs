//! Numbers as people read them.

/// A time: `1.24 s`, `38 ms`, `2 min 5 s`.
pub fn seconds(value: f64) -> String {
    if value >= 120.0 {
        format!("{:.0} min {:.0} s", (value / 60.0).floor(), value % 60.0)
    } else if value >= 10.0 {
        format!("{value:.1} s")
    } else if value >= 1.0 {
        format!("{value:.2} s")
    } else if value >= 0.001 {
        format!("{:.0} ms", value * 1e3)
    } else if value > 0.0 {
        format!("{:.0} µs", value * 1e6)
    } else {
        "0 s".into()
    }
}

/// An amount of memory: `12.3 MB`. Powers of ten.
pub fn bytes(value: u64) -> String {
    let value = value as f64;
    match value {
        v if v >= 1e9 => format!("{:.2} GB", v / 1e9),
        v if v >= 1e6 => format!("{:.1} MB", v / 1e6),
        v if v >= 1e3 => format!("{:.1} kB", v / 1e3),
        v => format!("{v:.0} B"),
    }
}

/// A share: `99.2 %`. Rounded down, so that 0.99999 does not read as all of it.
pub fn share(value: f64) -> String {
    if value >= 1.0 {
        return "100 %".into();
    }
    format!("{:.1} %", (value * 1000.0).floor() / 10.0)
}

/// A length or a cost, to four significant digits.
pub fn figure(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-3..1e5).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let whole_digits = if magnitude >= 1.0 { magnitude.log10().floor() as usize + 1 } else { 1 };
    let text = format!("{value:.*}", 4_usize.saturating_sub(whole_digits));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// `1 grasp`, `10 grasps`.
pub fn count(n: usize, one: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {one}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_carry_their_unit() {
        assert_eq!(seconds(125.2), "2 min 5 s");
        assert_eq!(seconds(12.34), "12.3 s");
        assert_eq!(seconds(1.234), "1.23 s");
        assert_eq!(seconds(0.0384), "38 ms");
        assert_eq!(seconds(0.0000384), "38 µs");
        assert_eq!(seconds(0.0), "0 s");
    }

    #[test]
    fn a_share_is_never_rounded_up() {
        assert_eq!(share(0.99999), "99.9 %");
        assert_eq!(share(1.0), "100 %");
        assert_eq!(share(0.0), "0.0 %");
    }

    #[test]
    fn figures_have_four_digits() {
        assert_eq!(figure(17.44444), "17.44");
        assert_eq!(figure(0.64025), "0.64");
        assert_eq!(figure(0.5), "0.5");
        assert_eq!(figure(12345.6), "12346");
        assert_eq!(figure(0.0), "0");
        assert_eq!(figure(1e-7), "1.000e-7");
        assert_eq!(figure(f64::NAN), "–");
    }

    #[test]
    fn memory_and_counts() {
        assert_eq!(bytes(12_300_000), "12.3 MB");
        assert_eq!(bytes(999), "999 B");
        assert_eq!(count(1, "grasp"), "1 grasp");
        assert_eq!(count(0, "grasp"), "0 grasps");
    }
}
