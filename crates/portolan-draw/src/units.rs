//! Quantities for people: two to three significant digits and a unit.

/// Bytes in decimal units: "173 kB".
pub fn shown_bytes(bytes: f64) -> String {
    const UNITS: [&str; 6] = ["B", "kB", "MB", "GB", "TB", "PB"];
    let (mut value, mut unit) = (bytes, 0);
    while value >= 1000.0 && unit + 1 < UNITS.len() {
        value /= 1000.0;
        unit += 1;
    }
    match unit {
        0 => format!("{value:.0} {}", UNITS[0]),
        _ => format!("{} {}", three_digits(value), UNITS[unit]),
    }
}

/// Seconds in the unit that suits them: "16.4 µs"; what is not positive is "0".
pub fn shown_seconds(seconds: f64) -> String {
    match seconds {
        s if s <= 0.0 => "0".into(),
        s if s < 1e-6 => format!("{} ns", three_digits(s * 1e9)),
        s if s < 1e-3 => format!("{} µs", three_digits(s * 1e6)),
        s if s < 1.0 => format!("{} ms", three_digits(s * 1e3)),
        s => format!("{} s", three_digits(s)),
    }
}

fn three_digits(value: f64) -> String {
    let digits = if value >= 100.0 {
        0
    } else if value >= 10.0 {
        1
    } else {
        2
    };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_a_unit_that_suits_them() {
        assert_eq!(shown_bytes(999.0), "999 B");
        assert_eq!(shown_bytes(4_650_000.0), "4.65 MB");
        assert_eq!(shown_bytes(173_000.0), "173 kB");
        assert_eq!(shown_seconds(0.0), "0");
        assert_eq!(shown_seconds(1.64e-5), "16.4 µs");
        assert_eq!(shown_seconds(0.123), "123 ms");
        assert_eq!(shown_seconds(2.0), "2.00 s");
    }
}
