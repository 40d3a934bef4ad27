//! Which rows of a trajectory a page keeps: all of them, or a window and what is extreme elsewhere.

/// Most numbers a page keeps row by row; 40 columns have 50 000 rows.
const NUMBERS: u64 = 2_000_000;
/// Most rows kept where all are.
const ALL: u64 = 50_000;
/// Rows of the window that is kept where not all are, as a share of those.
const WINDOW: f64 = 0.4;
/// Stretches of which the extremes are kept: more than a screen has pixels.
const STRETCHES: u64 = 4096;

/// What is kept of a column where rows are left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Treatment {
    /// Rows as they are.
    Row,
    /// The smallest and the largest of a stretch, in the order in which they come.
    Extremes,
    /// The same of the decimal logarithm of the size; a zero is a missing number.
    Logarithm,
}

/// The rows kept.
#[derive(Clone, Debug, Default)]
pub(super) struct KeptRows {
    /// Columns, all of one length.
    pub columns: Vec<Vec<f64>>,
    /// The first row kept as it was, and the one after the last.
    pub exact: [usize; 2],
    /// Rows there were.
    pub rows: u64,
}

/// Sees the rows of a trajectory one after the other.
#[derive(Debug)]
pub(super) struct Thinning {
    /// Number in the row, and treatment.
    treatments: Vec<(usize, Treatment)>,
    window: [f64; 2],
    /// Rows of a stretch; 1 where all are kept.
    stretch: u64,
    /// Rows of the window that may be kept.
    most: usize,
    kept: KeptRows,
    /// Of the stretch under way: rows seen, its first row and one of its middle, and what is extreme in each
    /// column.
    seen: u64,
    first: Vec<f64>,
    middle: Vec<f64>,
    extremes: Vec<RowExtremes>,
}

/// The smallest and the largest number of a stretch, each with the number of its row.
#[derive(Clone, Copy, Debug)]
struct RowExtremes {
    low: (f64, u64),
    high: (f64, u64),
}

impl RowExtremes {
    /// Of nothing.
    const NONE: Self = Self { low: (f64::INFINITY, 0), high: (f64::NEG_INFINITY, 0) };

    /// Sees a number; one that is none changes nothing.
    #[inline]
    fn see(&mut self, value: f64, row: u64) {
        if value < self.low.0 {
            self.low = (value, row);
        }
        if value > self.high.0 {
            self.high = (value, row);
        }
    }
}

impl Thinning {
    /// Keeps as many of `rows` rows as a page can hold, with the rows in `window` \[s\] as they are.
    pub fn new(treatments: Vec<(usize, Treatment)>, rows: u64, window: Option<[f64; 2]>) -> Self {
        let count = treatments.len();
        let all = (NUMBERS / count.max(1) as u64).clamp(2000, ALL);
        // A row more or less than the horizon makes one expect.
        let is_short = rows <= all + 2;
        Self {
            treatments,
            window: if is_short {
                [f64::NEG_INFINITY, f64::INFINITY]
            } else {
                window.unwrap_or([0.0, f64::INFINITY])
            },
            stretch: if is_short { 1 } else { rows.div_ceil(STRETCHES) },
            most: if is_short { usize::MAX } else { (WINDOW * all as f64) as usize },
            kept: KeptRows { columns: vec![Vec::new(); count], ..KeptRows::default() },
            seen: 0,
            first: Vec::new(),
            middle: Vec::new(),
            extremes: vec![RowExtremes::NONE; count],
        }
    }

    /// Sees a row.
    pub fn push(&mut self, row: &[f64]) {
        self.kept.rows += 1;
        let [begin, end] = self.kept.exact;
        let is_inside = (self.window[0]..=self.window[1]).contains(&row[0]);
        if is_inside && end - begin < self.most && (end == begin || end == self.len()) {
            self.close();
            if begin == end {
                self.kept.exact = [self.len(); 2];
            }
            for (column, &(source, treatment)) in self.kept.columns.iter_mut().zip(&self.treatments) {
                column.push(treated(row[source], treatment));
            }
            self.kept.exact[1] = self.len();
            return;
        }
        if self.seen == 0 {
            row.clone_into(&mut self.first);
        }
        // That of the middle, or of a stretch that ends before it the second.
        if self.seen == 1 || self.seen == self.stretch / 2 {
            row.clone_into(&mut self.middle);
        }
        for (extremes, &(source, treatment)) in self.extremes.iter_mut().zip(&self.treatments) {
            match treatment {
                Treatment::Row => {}
                // Logarithms are taken of the extremes alone.
                Treatment::Logarithm if row[source] == 0.0 => {}
                Treatment::Logarithm => extremes.see(row[source].abs(), self.seen),
                Treatment::Extremes => extremes.see(row[source], self.seen),
            }
        }
        self.seen += 1;
        if self.seen >= self.stretch {
            self.close();
        }
    }

    /// Ends the stretch under way: two rows, or one where it has but one.
    fn close(&mut self) {
        if self.seen == 0 {
            return;
        }
        let rows = [&self.first, &self.middle];
        let count = if self.seen > 1 { 2 } else { 1 };
        for ((column, &(source, treatment)), extremes) in
            self.kept.columns.iter_mut().zip(&self.treatments).zip(&mut self.extremes)
        {
            let RowExtremes { low, high } = *extremes;
            let pair = if low.1 <= high.1 { [low.0, high.0] } else { [high.0, low.0] };
            let is_missing = low.0 > high.0;
            column.extend((0..count).map(|k| match treatment {
                Treatment::Row => rows[k][source],
                _ if is_missing => f64::NAN,
                _ => treated(pair[k], treatment),
            }));
            *extremes = RowExtremes::NONE;
        }
        self.seen = 0;
    }

    fn len(&self) -> usize {
        self.kept.columns.first().map_or(0, Vec::len)
    }

    /// The rows kept.
    pub fn finish(mut self) -> KeptRows {
        self.close();
        self.kept
    }
}

fn treated(value: f64, treatment: Treatment) -> f64 {
    match treatment {
        Treatment::Logarithm if value == 0.0 => f64::NAN,
        Treatment::Logarithm => libm::log10(value.abs()),
        _ => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: [(usize, Treatment); 4] =
        [(0, Treatment::Row), (1, Treatment::Extremes), (1, Treatment::Row), (2, Treatment::Logarithm)];

    /// Rows at whole seconds: a peak a thousand rows, and a drift that is zero at first.
    fn kept(rows: u64, window: Option<[f64; 2]>) -> KeptRows {
        let mut thinning = Thinning::new(COLUMNS.to_vec(), rows, window);
        for k in 0..rows {
            let peak = if k % 1000 == 777 { 5.0 } else { (k as f64).sin() };
            thinning.push(&[k as f64, peak, if k < 10 { 0.0 } else { -1e-12 }]);
        }
        thinning.finish()
    }

    #[test]
    fn short_runs_are_kept_whole() {
        let kept = kept(50_000, None);
        assert_eq!((kept.exact, kept.rows), ([0, 50_000], 50_000));
        assert_eq!(kept.columns[1], kept.columns[2]);
        assert!(kept.columns[3][9].is_nan() && (kept.columns[3][10] + 12.0).abs() < 1e-12);
    }

    #[test]
    fn long_runs_keep_a_window_and_every_peak() {
        for window in [None, Some([400_000.0, 410_000.0]), Some([999_990.0, 2e6])] {
            let kept = kept(1_000_000, window);
            let [begin, end] = kept.exact;
            let [from, to] = window.unwrap_or([0.0, 19_999.0]);
            assert!(kept.columns[0].len() < 20_000 + 2 * 4096 + 4, "{}", kept.columns[0].len());
            assert!(kept.columns.iter().all(|column| column.len() == kept.columns[0].len()));
            assert_eq!((kept.columns[0][begin], kept.columns[0][end - 1]), (from, to.min(999_999.0)));
            assert_eq!(end - begin, (to.min(999_999.0) - from) as usize + 1);
            assert!(kept.columns[0].windows(2).all(|pair| pair[0] < pair[1]));
            assert_eq!(kept.columns[0][0], 0.0);
            // A peak of each of the thousand thousands, once or, where it ends a stretch, at most once.
            let peaks = kept.columns[1].iter().filter(|&&value| value == 5.0).count();
            assert!((990..=1000).contains(&peaks), "{peaks}");
        }
    }

    #[test]
    fn a_window_without_rows_keeps_none_as_it_was() {
        let kept = kept(100_000, Some([0.2, 0.8]));
        assert_eq!(kept.exact[0], kept.exact[1]);
    }
}
