//! What runs are timed by: given from outside, since nothing of an integration depends on the time of day.

use std::time::Duration;

/// The time since some fixed moment.
pub type Clock = fn() -> Duration;

/// A clock that stands still: what runs are timed by unless somebody gives another one.
pub(super) fn still() -> Duration {
    Duration::ZERO
}

/// The clock of the machine.
pub fn wall_clock() -> Duration {
    use std::sync::LazyLock;
    use std::time::Instant;
    static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    BEGIN.elapsed()
}
