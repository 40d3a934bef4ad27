//! What is looked at for the modes of places with friction: sets of contacts, and a mode of each place.

use super::FrictionMode;

/// The sets of contacts that may be closed: first those that stay without friction.
pub(super) fn subsets(staying: &[usize], touching: &[usize]) -> Vec<Vec<usize>> {
    let mut all = vec![staying.to_vec()];
    // More than a few would be too many.
    let few = &touching[..touching.len().min(6)];
    for bits in (0..1_usize << few.len()).rev() {
        let set: Vec<usize> =
            few.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, &contact)| contact).collect();
        if !all.contains(&set) {
            all.push(set);
        }
    }
    all
}

/// Every combination of one mode a place, by the number of places that do not take their first one.
pub(super) fn combinations(options: &[Vec<FrictionMode>]) -> Vec<Vec<FrictionMode>> {
    let mut all: Vec<(usize, Vec<FrictionMode>)> = vec![(0, Vec::new())];
    for of in options {
        all = all
            .iter()
            .flat_map(|(later, modes)| {
                of.iter().enumerate().map(move |(i, &mode)| {
                    let mut modes = modes.clone();
                    modes.push(mode);
                    (later + usize::from(i > 0), modes)
                })
            })
            .collect();
    }
    all.sort_by_key(|(later, _)| *later);
    all.into_iter().map(|(_, modes)| modes).collect()
}
