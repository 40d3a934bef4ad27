//! Pairs of a scene and a method: random ones, many at once, and the table of what was compared.

use super::mechanisms::{Dice, Generated, Kind, scene};
use super::reader::Scene;
use super::record::Record;
use super::start::start;
use super::verdict::{Difference, Verdict, compare, run};
use driftless::run::{METHODS, MethodId, Request, Stabilization};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Methods tried on each scene.
const METHODS_A_SCENE: usize = 5;
/// Evaluations of the auditor's after which a scene is left alone.
const MOST_EVALUATIONS: u64 = 150_000;
/// Evaluations a run may take.
const MAX_EVALUATIONS: u64 = 300_000;

/// One comparison.
pub struct Pair {
    pub seed: u64,
    pub kinds: BTreeSet<Kind>,
    pub request: Request,
    pub verdict: Verdict,
}

/// Pairs of the scenes from a seed on, at least so many, in order of their scenes.
pub fn pairs(count: usize, first: u64) -> Vec<Pair> {
    let (next, found) = (AtomicU64::new(0), Mutex::new(BTreeMap::new()));
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let compared = |found: &BTreeMap<u64, Vec<Pair>>| found.values().map(Vec::len).sum::<usize>();
    let work = || {
        loop {
            if compared(&found.lock().expect("no panic")) >= count {
                return;
            }
            let index = next.fetch_add(1, Ordering::Relaxed);
            let of_scene = scene_pairs(&scene(first.wrapping_mul(0x1_0000_0001).wrapping_add(index)));
            found.lock().expect("no panic").insert(index, of_scene);
        }
    };
    std::thread::scope(|scope| {
        let handles: Vec<_> = (0..threads)
            .map(|_| {
                std::thread::Builder::new().stack_size(16 << 20).spawn_scoped(scope, work).expect("a thread")
            })
            .collect();
        handles.into_iter().for_each(|handle| handle.join().expect("no panic"));
    });
    // The same pairs whatever the number of threads.
    let mut pairs = Vec::new();
    for (_, of_scene) in found.into_inner().expect("no panic") {
        if pairs.len() >= count {
            break;
        }
        pairs.extend(of_scene);
    }
    pairs
}

/// A scene against several methods.
fn scene_pairs(made: &Generated) -> Vec<Pair> {
    let mut dice = Dice::new(made.seed ^ 0xa0d1);
    let mut pairs = Vec::new();
    let mut methods: Vec<MethodId> = METHODS.iter().map(|info| info.id).collect();
    let record = record(&made.text);
    for _ in 0..METHODS.len() {
        if pairs.len() == METHODS_A_SCENE {
            break;
        }
        let method = methods.swap_remove(dice.pick(methods.len()));
        let request = request(method, &mut dice);
        let ran = match run(&made.text, &request) {
            Ok(ran) => ran,
            // What the program does not offer is no pair.
            Err(why) if why.starts_with("plan") => continue,
            Err(why) => {
                let verdict = Verdict::Reported(why.chars().take(80).collect());
                pairs.push(Pair { seed: made.seed, kinds: made.kinds.clone(), request, verdict });
                continue;
            }
        };
        let verdict = match &record {
            Ok(record) => compare(record, &ran),
            Err(why) => Verdict::Unclear(why.clone()),
        };
        pairs.push(Pair { seed: made.seed, kinds: made.kinds.clone(), request, verdict });
    }
    pairs
}

/// A method with a random tolerance, and at times a stabilization.
fn request(method: MethodId, dice: &mut Dice) -> Request {
    let mut request =
        Request { method: Some(method), max_evaluations: Some(MAX_EVALUATIONS), ..Request::default() };
    if method.is_adaptive() && dice.chance(0.7) {
        request.rtol = Some(dice.one(&[1e-5, 1e-6, 1e-7, 1e-8, 1e-10, 1e-11, 1e-12]));
    }
    if dice.chance(0.2) {
        request.stabilize = Some(dice.one(&Stabilization::ALL));
    }
    request
}

/// The auditor's motion of a scene at the times of its rows; every number of the start must be given.
pub fn record(text: &str) -> Result<Record, String> {
    let scene = Scene::read(text);
    let rows = (scene.until / scene.every).round();
    let time = |row: usize| if row as f64 == rows { scene.until } else { scene.every * row as f64 };
    let times: Vec<f64> = (0..=rows as usize).map(time).collect();
    let start = start(scene, None).map_err(|lost| lost.0)?;
    let size = start.model.scene.size;
    if start.correction[0] > 1e-9 * size.max(1.0) || start.correction[0].is_nan() {
        return Err(format!("the start is off its constraints by {:.1e}", start.correction[0]));
    }
    Record::new(start, &times, MOST_EVALUATIONS).map_err(|lost| lost.0)
}

/// Counts of pairs, and everything that differs.
#[derive(Default)]
pub struct Summary {
    pub total: usize,
    pub agreeing: usize,
    pub with_walls: usize,
    /// Of the pairs that agree, the largest difference over what is allowed.
    pub nearest: f64,
    pub reported: BTreeMap<String, (usize, u64)>,
    /// Counts, and the first scene of each.
    pub unclear: BTreeMap<String, (usize, u64)>,
    pub differing: Vec<(u64, Request, Vec<Difference>)>,
    /// Compared pairs of two kinds, and of a kind with a method.
    pub kinds: BTreeMap<(Kind, Kind), usize>,
    pub methods: BTreeMap<(Kind, &'static str), usize>,
    /// Compared triples.
    pub triples: BTreeMap<(Kind, Kind, &'static str), usize>,
}

impl Summary {
    pub fn of(pairs: Vec<Pair>) -> Self {
        let mut summary = Self { total: pairs.len(), ..Self::default() };
        for Pair { seed, kinds, request, verdict } in pairs {
            let is_compared = matches!(verdict, Verdict::Agrees(_) | Verdict::Differs(_));
            if is_compared {
                let method = request.method.map_or("", |method| method.info().name);
                summary.with_walls += usize::from(kinds.iter().any(|kind| kind.is_wall()));
                for &a in &kinds {
                    *summary.methods.entry((a, method)).or_default() += 1;
                    for &b in kinds.range(a..) {
                        *summary.kinds.entry((a, b)).or_default() += 1;
                        *summary.triples.entry((a, b, method)).or_default() += 1;
                    }
                }
            }
            match verdict {
                Verdict::Agrees(worst) => {
                    summary.agreeing += 1;
                    summary.nearest = summary.nearest.max(worst);
                }
                Verdict::Reported(how) => summary.reported.entry(digitless(&how)).or_insert((0, seed)).0 += 1,
                Verdict::Unclear(why) => summary.unclear.entry(digitless(&why)).or_insert((0, seed)).0 += 1,
                Verdict::Differs(found) => summary.differing.push((seed, request, found)),
            }
        }
        summary
    }

    /// Counts on a page.
    pub fn text(&self) -> String {
        let Self { total, agreeing, with_walls, nearest, reported, unclear, differing, .. } = self;
        let mut text = format!(
            "{total} pairs: {agreeing} agree, {} differ, {} report themselves, {} are unclear; {with_walls} of those compared have walls; the largest difference that agrees is {nearest:.2} of what is allowed\n",
            differing.len(),
            total_of(reported),
            total_of(unclear)
        );
        for (title, counts) in [("report themselves", reported), ("unclear", unclear)] {
            for (why, (count, seed)) in counts {
                text += &format!("    {title}: {count:5}  {why} (seed {seed})\n");
            }
        }
        for (seed, request, found) in differing {
            let method = request.method.map_or("", |method| method.info().name);
            let how = format!("{method} rtol {:?} {:?}", request.rtol, request.stabilize);
            text += &format!("seed {seed} by {how}: {} differences\n", found.len());
            found.iter().take(3).for_each(|difference| text += &format!("    {difference}\n"));
        }
        text
    }
}

/// All of such counts.
pub fn total_of(counts: &BTreeMap<String, (usize, u64)>) -> usize {
    counts.values().map(|(count, _)| count).sum()
}

/// Numbers in a reason say nothing of its kind.
fn digitless(text: &str) -> String {
    let word = |word: &str| {
        if word.starts_with(|letter: char| letter.is_ascii_digit()) {
            "…".to_owned()
        } else {
            word.to_owned()
        }
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}
