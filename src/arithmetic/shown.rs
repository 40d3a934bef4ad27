//! Numbers as messages, pages and charts tell them: rounded, everyday sizes without an exponent, and no zeros
//! at the end that say nothing.

/// A number with its shortest digits, the exponent apart where it is far from everyday size.
pub(crate) fn plain(x: f64) -> String {
    let size = x.abs();
    if size != 0.0 && !(1e-3..1e6).contains(&size) { format!("{x:e}") } else { x.to_string() }
}

/// A number to so many significant digits, as [`plain`] writes it.
fn rounded(x: f64, digits: usize) -> String {
    plain(format!("{x:.0$e}", digits - 1).parse().unwrap_or(x))
}

/// To four digits, for what is measured rather than given.
pub(crate) fn about(x: f64) -> String {
    rounded(x, 4)
}

/// To two digits, for an estimate: `1.7`, `3e7`.
pub(crate) fn estimate(x: f64) -> String {
    rounded(x, 2)
}

/// To one digit, for an order of magnitude: `0.2`, `1e-9`.
pub(crate) fn order(x: f64) -> String {
    rounded(x, 1)
}

/// An estimated count: whole, to two digits, and at least one.
pub(crate) fn count(x: f64) -> String {
    if x < 1e6 { estimate(x.ceil().max(1.0)) } else { estimate(x) }
}

/// An estimated count of steps: `1 step`, `20 steps`.
pub(crate) fn steps(x: f64) -> String {
    let steps = if x <= 1.0 { "step" } else { "steps" };
    format!("{} {steps}", count(x))
}

/// The step \[s\] of a stop in brackets, with a space before them; nothing where none was tried.
pub(crate) fn tried(step: f64) -> String {
    if step == 0.0 { String::new() } else { format!(" (step {} s)", about(step)) }
}

/// To six digits.
pub(crate) fn figure(x: f64) -> String {
    decimal(x, 6)
}

/// To three digits, for what need not be exact.
pub(crate) fn rough(x: f64) -> String {
    decimal(x, 3)
}

fn decimal(x: f64, digits: i32) -> String {
    if x == 0.0 {
        return "0".into();
    }
    if !x.is_finite() {
        return not_finite(x).into();
    }
    // By its size as it is shown: 999999.7 to six digits is 1e6.
    let text = format!("{x:.0$e}", digits as usize - 1);
    let size = text.parse().unwrap_or(x).abs();
    if !(1e-4..1e6).contains(&size) {
        let Some((mantissa, exponent)) = text.split_once('e') else { return text };
        return format!("{}e{exponent}", without_zeros(mantissa));
    }
    let decimals = (digits - 1 - size.log10().floor() as i32).clamp(0, 9) as usize;
    without_zeros(&format!("{x:.decimals$}")).to_owned()
}

fn without_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// A size that matters by its magnitude only, always to two digits: `2.1e-13`, `3.0e-14`; `0.0087` where it
/// is of everyday size.
pub(crate) fn magnitude(x: f64) -> String {
    match x {
        0.0 => "0".into(),
        x if !x.is_finite() => not_finite(x).into(),
        x if (1e-3..1e6).contains(&x.abs()) => estimate(x),
        _ => format!("{x:.1e}"),
    }
}

fn not_finite(x: f64) -> &'static str {
    match x {
        f64::INFINITY => "infinite",
        f64::NEG_INFINITY => "-infinite",
        _ => "not a number",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_keep_their_size() {
        for (x, shown) in [
            (0.0, "0"),
            (-20.990_323, "-20.9903"),
            (100.0, "100"),
            (0.005, "0.005"),
            (1.234_567_8e-5, "1.23457e-5"),
            (123_456.7, "123457"),
            (1e6, "1e6"),
            (999_999.7, "1e6"),
            (99.999_99, "100"),
            (-1.5e-12, "-1.5e-12"),
            (f64::NAN, "not a number"),
            (f64::INFINITY, "infinite"),
        ] {
            assert_eq!(figure(x), shown);
        }
        assert_eq!([rough(10.4609), rough(10_000.0), rough(1e-8)], ["10.5", "10000", "1e-8"]);
        assert_eq!([2.14e-13, 3e-14, 0.008_71, 1.0].map(magnitude), ["2.1e-13", "3.0e-14", "0.0087", "1"]);
    }

    #[test]
    fn estimates_are_of_everyday_form_where_they_are_of_everyday_size() {
        assert_eq!([1.7, 8.34, 0.0, 3.14e7, 0.02].map(estimate), ["1.7", "8.3", "0", "3.1e7", "0.02"]);
        assert_eq!([5.0, 1.83, 1e-9, 31.4].map(order), ["5", "2", "1e-9", "30"]);
        assert_eq!([0.3, 20.04, 3.14e7, 1e9].map(count), ["1", "21", "3.1e7", "1e9"]);
        assert_eq!([0.3, 20.04].map(steps), ["1 step", "21 steps"]);
        assert_eq!([1.00004, 123_456.7, 1e-12].map(about), ["1", "123500", "1e-12"]);
    }
}
