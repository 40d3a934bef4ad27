//! Names too long for their place: cut where they agree, or set in several lines.

use super::panel::LEADER;
use super::sheet::{NAME, NOTE, Sheet};
use super::text::{plain, unmarked};
use super::ticks::Ticks;

/// Most lines of the name of an upright axis.
const LINES: usize = 3;

/// Whether words fit into what [`label_room`](super::grid::label_room) can give them at most.
fn fits_beside(sheet: &Sheet) -> impl Fn(&str) -> bool + '_ {
    let room = sheet.size[0] / 3.0 - LEADER - 18.0;
    move |text| sheet.width(text, NOTE, false) <= room
}

/// The words, cut in the middle to what fits beside a panel: names that begin alike end otherwise.  Those
/// that would be the same then keep what they differ in.
pub(crate) fn shortened_apart<'a>(sheet: &Sheet, labels: impl Iterator<Item = &'a str>) -> Vec<String> {
    apart(&labels.collect::<Vec<_>>(), &fits_beside(sheet))
}

fn letters(label: &str) -> Vec<char> {
    unmarked(label).chars().collect()
}

fn literal(letters: &[char]) -> String {
    plain(&letters.iter().collect::<String>())
}

/// So many letters, half of them from the beginning and half from the end.
fn cut(letters: &[char], kept: usize) -> String {
    format!("{}…{}", literal(&letters[..kept.div_ceil(2)]), literal(&letters[letters.len() - kept / 2..]))
}

fn cut_to(label: &str, fits: &impl Fn(&str) -> bool) -> String {
    if fits(label) {
        return label.to_owned();
    }
    let letters = letters(label);
    let mut cuts = (0..letters.len()).rev().map(|kept| cut(&letters, kept));
    cuts.find(|cut| fits(cut)).unwrap_or_else(|| "…".to_owned())
}

fn apart(labels: &[&str], fits: &impl Fn(&str) -> bool) -> Vec<String> {
    let short: Vec<String> = labels.iter().map(|label| cut_to(label, fits)).collect();
    let one = |k: usize| {
        let alike = labels.iter().zip(&short).filter(|(_, other)| **other == short[k]);
        let alike: Vec<Vec<char>> = alike.map(|(label, _)| letters(label)).collect();
        let own = letters(labels[k]);
        if alike.iter().all(|other| *other == own) { short[k].clone() } else { around(&own, &alike, fits) }
    };
    (0..labels.len()).map(one).collect()
}

/// The part in which a name differs from others that begin and end alike, with as much around it as fits.
fn around(own: &[char], alike: &[Vec<char>], fits: &impl Fn(&str) -> bool) -> String {
    let shared = |agrees: &dyn Fn(&[char], usize) -> bool| {
        (0..own.len()).take_while(|&k| alike.iter().all(|other| agrees(other, k))).count()
    };
    let shortest = alike.iter().map(Vec::len).min().unwrap_or(0);
    let before = shared(&|other, k| other.get(k) == Some(&own[k]));
    let behind = shared(&|other, k| k < other.len() && other[other.len() - 1 - k] == own[own.len() - 1 - k]);
    let behind = behind.min(shortest - before);
    let core = &own[before..own.len() - behind];
    let with = |kept: usize| {
        let head = kept.div_ceil(2).max(kept.saturating_sub(behind)).min(before);
        let tail = (kept - head).min(behind);
        let gap = |is_cut: bool| if is_cut { "…" } else { "" };
        let [head_gap, tail_gap] = [gap(head < before), gap(tail < behind)];
        let [head, core, tail] = [&own[..head], core, &own[own.len() - tail..]].map(literal);
        format!("{head}{head_gap}{core}{tail_gap}{tail}")
    };
    let found = (0..=before + behind).rev().map(with).find(|text| fits(text));
    found.unwrap_or_else(|| cut_to(&literal(core), fits))
}

/// The lines of the name of an upright axis, none longer than `room`: broken at joints of the name, the
/// name cut in the middle where that is not enough.
pub(crate) fn axis_lines(sheet: &Sheet, ticks: &Ticks, name: &str, room: f64) -> Vec<String> {
    let fits = |text: &str| sheet.width(text, NAME, false) <= room;
    let whole = ticks.name(name);
    if fits(&whole) {
        return vec![whole];
    }
    let [quantity, offset, unit] = ticks.parts(name);
    // Between the number of the offset and its unit, which follow a sign, a line may end.
    let (number, of_offset) = match offset.match_indices(' ').nth(1) {
        Some((at, _)) => (&offset[..at], &offset[at + 1..]),
        None => (offset.as_str(), ""),
    };
    let letters = letters(&quantity);
    let broken = |quantity: &str| {
        let rest = [number, of_offset, &unit].into_iter().map(|part| (" ", part.to_owned()));
        lines(pieces(quantity).into_iter().chain(rest), &fits)
    };
    let cuts = (0..letters.len()).rev().map(|kept| broken(&cut(&letters, kept)));
    let mut all = std::iter::once(broken(&quantity)).chain(cuts);
    all.find(|lines| lines.len() <= LINES && lines.iter().all(|line| fits(line)))
        .unwrap_or_else(|| broken("…"))
}

/// Parts of a name between which a line may end, each with what joins it to the one before.
fn pieces(name: &str) -> Vec<(&'static str, String)> {
    let mut pieces = vec![("", String::new())];
    let (mut is_italic, mut depth, mut is_literal) = (false, 0_usize, false);
    for c in name.chars() {
        let is_free = !is_italic && depth == 0;
        if c == ' ' && is_free {
            pieces.push((" ", String::new()));
            continue;
        }
        if let Some((_, piece)) = pieces.last_mut() {
            piece.push(c);
        }
        match c {
            '*' if !is_literal => is_italic = !is_italic,
            '{' => depth += 1,
            '}' => depth = depth.saturating_sub(1),
            '_' if is_literal && is_free => pieces.push(("", String::new())),
            '.' | ':' | '…' if is_free => pieces.push(("", String::new())),
            _ => {}
        }
        is_literal = c == '\\' && !is_literal;
    }
    pieces
}

/// Lines as full as they can be.
fn lines(pieces: impl Iterator<Item = (&'static str, String)>, fits: &impl Fn(&str) -> bool) -> Vec<String> {
    let mut lines = vec![String::new()];
    for (joint, piece) in pieces.filter(|(_, piece)| !piece.is_empty()) {
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(&piece),
            Some(line) if fits(&format!("{line}{joint}{piece}")) => {
                line.push_str(joint);
                line.push_str(&piece);
            }
            _ => lines.push(piece),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn narrow(most: usize) -> impl Fn(&str) -> bool {
        move |text| unmarked(text).chars().count() <= most
    }

    #[test]
    fn names_that_begin_and_end_alike_keep_what_they_differ_in() {
        let names: Vec<String> =
            (1..=12).map(|k| format!("output\\_number\\_{k}\\_with\\_a\\_long\\_name")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let short = apart(&names, &narrow(20));
        assert_eq!(unmarked(&short[0]), "output_nu…1…ong_name");
        assert_eq!(unmarked(&short[11]), "output_n…12…ong_name");
        let other = apart(&["of the first kind", "of the other kind", "short", "short"], &narrow(9));
        assert_eq!(other, ["o…first…d", "o…other…d", "short", "short"]);
        assert_eq!(apart(&["a name too long"], &narrow(9)), ["a na…long"]);
    }

    #[test]
    fn names_of_axes_break_at_their_joints_and_are_cut_last() {
        let sheet = Sheet::new([480.0, 300.0], 1.0).unwrap();
        let none = Ticks::default();
        let set = |ticks: &Ticks, name: &str| -> Vec<String> {
            let lines = axis_lines(&sheet, ticks, name, 90.0);
            assert!(lines.iter().all(|line| sheet.width(line, NAME, false) <= 90.0), "{lines:?}");
            lines.iter().map(|line| unmarked(line)).collect()
        };
        assert_eq!(set(&none, "force [N]"), ["force [N]"]);
        assert_eq!(
            set(&none, "left\\_front\\_suspension\\_arm [rad]"),
            ["left_front_", "suspension_arm", "[rad]"]
        );
        assert_eq!(set(&none, "angular acceleration [rad/s²]"), ["angular", "acceleration", "[rad/s²]"]);
        let far = Ticks {
            factor: Some("×10^{−12}".to_owned()),
            offset: Some("− 0.6244338578".to_owned()),
            ..Ticks::default()
        };
        assert_eq!(set(&far, "bearing [N]"), ["bearing", "− 0.6244338578", "N [×10−12 N]"]);
        let long = set(&none, &format!("{} [rad]", "abcdefgh".repeat(8)));
        assert!(long.len() <= LINES && long[0].starts_with("abcdefgh") && long[1].contains("h"), "{long:?}");
    }
}
