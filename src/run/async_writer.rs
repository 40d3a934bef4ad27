//! A trajectory written beside the run, by a thread of its own: where rows are dense, digits, hash and file
//! take longer than the method.
//!
//! Rows go over as numbers, many at a time; short runs, and machines that give no thread, write where they
//! are.  The bytes are those of [`Table`].

use super::sample::Sample;
use super::table::{Shown, Table};
use std::io::{self, Write};
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::thread::{Builder, JoinHandle};

/// Numbers handed over at a time, at least.
const BATCH: usize = 4096;
/// Batches that may wait to be written.
const WAITING: usize = 4;

/// Writes samples into a table.
///
/// What the writer fails with is told by a later call: some batches later, at the latest where the table is
/// asked for.
pub struct AsyncWriter<W: Write + Send + 'static> {
    /// Where no thread has it.
    table: Option<Table<W>>,
    away: Option<Away<W>>,
    /// Rows to hand over.
    numbers: Vec<f64>,
    /// Where the last of them begins.
    last: usize,
    shown: Shown,
}

/// The thread that writes.
struct Away<W: Write> {
    full: SyncSender<Vec<f64>>,
    empty: Receiver<Vec<f64>>,
    thread: JoinHandle<(Option<Table<W>>, io::Result<()>)>,
}

impl<W: Write + Send + 'static> Away<W> {
    /// Has the table written on by a thread; leaves it where there is none to be had.
    fn begin(table: &mut Option<Table<W>>) -> Option<Self> {
        let (full, batches) = sync_channel::<Vec<f64>>(WAITING);
        let (used, empty) = channel();
        let (give, given) = sync_channel::<Table<W>>(1);
        let write = move || {
            let Ok(mut table) = given.recv() else { return (None, Ok(())) };
            let written = batches.iter().try_for_each(|mut batch| {
                table.lines(&batch)?;
                batch.clear();
                // Nobody takes it back at the end.
                let _ = used.send(batch);
                Ok(())
            });
            (Some(table), written)
        };
        let thread = Builder::new().name("trajectory".into()).spawn(write).ok()?;
        *table = give.send(table.take()?).err().map(|unsent| unsent.0);
        Some(Self { full, empty, thread })
    }

    /// The table, once all that was handed over is in it, and what went wrong.
    fn end(self) -> (Option<Table<W>>, io::Result<()>) {
        drop(self.full);
        self.thread.join().unwrap_or_else(|panic| resume_unwind(panic))
    }
}

impl<W: Write + Send + 'static> AsyncWriter<W> {
    /// Goes on with a table.
    pub fn new(table: Table<W>) -> Self {
        Self { shown: table.shown(), table: Some(table), away: None, numbers: Vec::new(), last: 0 }
    }

    /// Writes a row, sooner or later; its numbers, in the order of the header.
    ///
    /// # Errors
    /// What the writer said of earlier rows.
    pub fn write(&mut self, sample: &Sample) -> io::Result<&[f64]> {
        if self.numbers.len() >= BATCH {
            self.hand_over()?;
        }
        self.last = self.numbers.len();
        self.shown.append(sample, &mut self.numbers);
        Ok(&self.numbers[self.last..])
    }

    /// The table with every row in it; it is written here until many more have come.
    ///
    /// # Errors
    /// What the writer says.
    pub fn table(&mut self) -> io::Result<&mut Table<W>> {
        if let Some(away) = self.away.take() {
            let (table, written) = away.end();
            self.table = table;
            written?;
        }
        let table = self.table.as_mut().ok_or_else(|| io::Error::other("the table is lost"))?;
        table.lines(&self.numbers)?;
        self.numbers.clear();
        Ok(table)
    }

    /// Writes out what is there and hands the writer back.
    ///
    /// # Errors
    /// What the writer says.
    pub fn finish(mut self) -> io::Result<W> {
        self.table()?.written()?;
        self.table.take().ok_or_else(|| io::Error::other("the table is lost"))?.finish()
    }

    /// Gives the thread its next batch.
    fn hand_over(&mut self) -> io::Result<()> {
        if self.away.is_none() {
            self.away = Away::begin(&mut self.table);
        }
        let Some(Away { full, empty, .. }) = &self.away else { return self.table().map(drop) };
        let next = empty.try_recv().unwrap_or_else(|_| Vec::with_capacity(BATCH + BATCH / 4));
        let batch = std::mem::replace(&mut self.numbers, next);
        // It takes no more where its writer has failed.
        full.send(batch).or_else(|_| self.table().map(drop))
    }
}

impl<W: Write + Send + 'static> Drop for AsyncWriter<W> {
    /// Waits until nothing is written any more.
    fn drop(&mut self) {
        if let Some(Away { full, thread, .. }) = self.away.take() {
            drop(full);
            // What it says was not asked for.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Mechanism;
    use crate::run::table::header;
    use crate::scene::read_scene;
    use std::sync::{Arc, Mutex};

    fn mechanism() -> Mechanism {
        Mechanism::new(&read_scene("examples/scenes/motor.json".as_ref(), &[]).expect("a scene"))
            .expect("equations")
    }

    fn sample(i: u32) -> Sample {
        let x = f64::from(i) * 0.1;
        let pair = [x.sin(), x.cos()];
        Sample {
            t: x,
            phi: vec![x; 2],
            omega: vec![-x; 2],
            centre: vec![pair; 2],
            velocity: vec![pair; 2],
            constraints: vec![pair],
            motors: vec![pair],
            ..Sample::default()
        }
    }

    #[test]
    fn its_bytes_are_those_of_the_table() {
        let mechanism = mechanism();
        for rows in [0, 1, 100, 4 * WAITING as u32 * BATCH as u32 / 20] {
            let mut table = Table::new(&mechanism, Vec::new()).expect("a header");
            let mut writer = AsyncWriter::new(Table::new(&mechanism, Vec::new()).expect("a header"));
            for i in 0..rows {
                table.write(&sample(i)).expect("room");
                let row = writer.write(&sample(i)).expect("room");
                assert_eq!((row[0], row.len()), (sample(i).t, header(&mechanism).len()));
                if i == rows / 3 {
                    let length = |table: &mut Table<Vec<u8>>| table.written().expect("room").len();
                    assert_eq!(length(writer.table().expect("room")), length(&mut table));
                }
            }
            assert!(writer.finish().expect("room") == table.finish().expect("room"), "{rows} rows");
        }
    }

    /// Takes so many bytes; its drop is seen.
    struct Full(usize, Arc<Mutex<bool>>);

    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0 =
                self.0.checked_sub(bytes.len()).ok_or_else(|| io::Error::from(io::ErrorKind::StorageFull))?;
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Drop for Full {
        fn drop(&mut self) {
            *self.1.lock().expect("nobody panicked") = true;
        }
    }

    #[test]
    fn what_the_writer_fails_with_ends_the_run() {
        let gone = Arc::new(Mutex::new(false));
        let table = Table::new(&mechanism(), Full(1 << 20, Arc::clone(&gone))).expect("a header");
        let mut writer = AsyncWriter::new(table);
        let failed = (0..1 << 20).find_map(|i| writer.write(&sample(i)).err()).expect("an error");
        assert_eq!(failed.kind(), io::ErrorKind::StorageFull);
        drop(writer);
        assert!(*gone.lock().expect("nobody panicked"));
    }

    #[test]
    fn a_scribe_given_up_leaves_no_writer_behind() {
        let gone = Arc::new(Mutex::new(false));
        let mut writer = AsyncWriter::new(
            Table::new(&mechanism(), Full(usize::MAX, Arc::clone(&gone))).expect("a header"),
        );
        for i in 0..10_000 {
            writer.write(&sample(i)).expect("room");
        }
        drop(writer);
        assert!(*gone.lock().expect("nobody panicked"));
    }
}
