//! Minima that do not explain the data: residuals far above the noise that was told, or, where nobody says,
//! about as large as what the data vary by.

use super::FittedColumn;
use super::noise::spread;

/// Rms of the residuals of a column, over its noise, from which that is no chance.
const FAR: f64 = 2.0;
/// Standard deviations by which a sum of squares must be above its mean as well: of few values such an rms
/// may be chance.
const DEVIATIONS: f64 = 5.0;
/// Rms of the residuals over the spread of the data where nobody says what the noise is.
const SHARE: f64 = 0.5;

/// What is doubtful of this minimum, in words.
pub(super) fn doubts(columns: &[FittedColumn]) -> Option<String> {
    let found: Vec<String> = columns.iter().filter_map(doubt).collect();
    (!found.is_empty()).then(|| {
        format!(
            "{}: the scene does not explain the data with these numbers; other guesses or --segments may \
                lead to a lower minimum",
            found.join(", ")
        )
    })
}

fn doubt(column: &FittedColumn) -> Option<String> {
    // Without values it is no number, and above nothing.
    let (name, rms) = (&column.name, column.rms());
    let over = |size: f64| format!("{:.*}", usize::from(rms < 10.0 * size), rms / size);
    if column.is_given {
        let chance = (1.0 + DEVIATIONS * (2.0 / column.count() as f64).sqrt()).sqrt();
        let sigma = column.sigma;
        return (rms > FAR.max(chance) * sigma)
            .then(|| format!("the residuals of {name} are {} times its sigma", over(sigma)));
    }
    let spread = spread(&column.measured);
    (rms > SHARE * spread && spread > 0.0)
        .then(|| format!("the residuals of {name} are {} of what its data vary by", over(spread)))
}
