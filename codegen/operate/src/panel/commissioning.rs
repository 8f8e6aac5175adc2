//! A commissioning that a page begins: `specgen commission` in a thread, with a session of its own, beside that of the panel.
//!
//! The panel goes on to show the machine, and *hold* and *ramp down* of every page go to it at once: the machine stops, the command
//! finds that and ends with the machine ramped down. Its folder keeps what was measured; begun again, it continues.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use serde_json::{Value, json};
use specgen_language::outcome::Failure;
use specgen_language::ui::{Message, Ui};

use super::QUERY;

/// A run of the command.
pub type Run = dyn Fn(&mut Ui) -> Result<(), Failure> + Send + Sync;

/// The command, and what it has to do.
pub struct Commissioning {
    /// Folder of its records and results.
    pub folder: PathBuf,
    /// Runs it until it is done or `stop` is set.
    pub run: Arc<Run>,
    /// Steps, time left and findings.
    pub outlook: Box<dyn Fn() -> Result<Value, Failure>>,
    /// Ends it after its present step.
    pub stop: Arc<AtomicBool>,
}

/// A commissioning of a panel.
pub(super) struct Runner {
    given: Commissioning,
    thread: Option<JoinHandle<Result<(), String>>>,
    /// Its last line.
    message: Arc<Mutex<String>>,
    /// How it ended, unless it is done.
    ended: Option<String>,
    outlook: Value,
    looked: Option<Instant>,
}

impl Runner {
    pub fn new(given: Commissioning) -> Self {
        Self { given, thread: None, message: Arc::default(), ended: None, outlook: Value::Null, looked: None }
    }

    pub fn runs(&self) -> bool {
        self.thread.is_some()
    }

    /// Begins or continues.
    pub fn begin(&mut self) -> Result<(), String> {
        if self.runs() {
            return Err("the commissioning is running".to_owned());
        }
        self.given.stop.store(false, Ordering::Relaxed);
        self.ended = None;
        let (run, last) = (self.given.run.clone(), self.message.clone());
        self.thread = Some(std::thread::spawn(move || {
            let listener = move |message: Message<'_>| {
                if let Message::Progress(line) = message {
                    line.clone_into(&mut last.lock().unwrap_or_else(PoisonError::into_inner));
                }
            };
            run(&mut Ui::called(listener, None)).map_err(|failure| failure.message())
        }));
        Ok(())
    }

    /// Ends it after its present step; what stops the machine ends that, too.
    pub fn stop(&self) {
        self.given.stop.store(true, Ordering::Relaxed);
    }

    /// Its state for pages, and the text of an event if it has just ended.
    pub fn look(&mut self) -> (Value, Option<String>) {
        let mut event = None;
        if let Some(thread) = self.thread.take_if(|thread| thread.is_finished()) {
            let done = thread.join().unwrap_or_else(|_| Err("it crashed".to_owned()));
            event = Some(match &done {
                Ok(()) => "The commissioning is done, as far as this controller goes.".to_owned(),
                Err(why) => format!("The commissioning ended: {why}."),
            });
            (self.ended, self.looked) = (done.err(), None);
        }
        // While nothing runs, nothing changes.
        let is_due = self.looked.is_none_or(|looked| self.runs() && looked.elapsed() >= QUERY);
        if is_due {
            self.looked = Some(Instant::now());
            self.outlook = (self.given.outlook)().unwrap_or_else(|failure| json!({ "refused": failure.message() }));
        }
        let message = self.message.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let folder = self.given.folder.display().to_string();
        let state = json!({
            "runs": self.runs(), "message": message, "ended": self.ended, "folder": folder, "outlook": self.outlook,
        });
        (state, event)
    }

    /// The page about it, if there is one.
    pub fn page(&self) -> PathBuf {
        self.given.folder.join("commission.html")
    }
}

impl Drop for Runner {
    /// Waits until the machine is ramped down.
    fn drop(&mut self) {
        self.stop();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
