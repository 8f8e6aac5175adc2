//! A command as a function: it runs in a thread of its own, without the interpreter, while the calling one looks after signals.

use std::ffi::OsString;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::{Py, PyAny, PyErr, PyResult, Python, pyfunction};

/// How often signals are looked after.
const GLANCE: Duration = Duration::from_millis(50);
/// How long an interrupted command may take to come to a result. One that takes longer goes on to the end of what it is at, unheard.
const PATIENCE: Duration = Duration::from_secs(10);

/// What a running command says.
enum Word {
    Progress(String),
    Document(String),
}

/// Runs `specgen ARGUMENTS` and returns the JSON document that the command prints with `--json`.
///
/// `progress` is called with each line of progress. The interpreter is free meanwhile. After Ctrl-C, a command that has a result on
/// the way returns it with exit code 130; any other raises KeyboardInterrupt.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None))]
pub fn call(py: Python<'_>, arguments: Vec<OsString>, progress: Option<Py<PyAny>>) -> PyResult<String> {
    // A byte a call, which a thread may look at when nobody waits for it any more.
    let stop: &'static AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
    let (tell, mut words) = mpsc::channel();
    thread::Builder::new().name("specgen".to_owned()).spawn(move || {
        let hear = {
            let tell = tell.clone();
            move |line: &str| {
                // Where nobody listens any more, it was told to stop.
                let _ = tell.send(Word::Progress(line.to_owned()));
            }
        };
        let document = specgen::cli::call(arguments, stop, hear).to_string();
        let _ = tell.send(Word::Document(document));
    })?;
    let mut raised: Option<(PyErr, Instant)> = None;
    loop {
        // There and back: a receiver is not shared.
        let (back, word) = py.detach(move || {
            let word = words.recv_timeout(GLANCE);
            (words, word)
        });
        words = back;
        match word {
            Ok(Word::Document(document)) => {
                let error = raised.map(|(error, _)| error);
                // What an interrupt left of a result is the caller's; what else was raised is raised.
                return error
                    .filter(|error| !error.is_instance_of::<PyKeyboardInterrupt>(py))
                    .map_or(Ok(document), Err);
            }
            Ok(Word::Progress(line)) => {
                if raised.is_none()
                    && let Some(progress) = &progress
                    && let Err(error) = progress.call1(py, (line,))
                {
                    stop.store(true, Ordering::SeqCst);
                    raised = Some((error, Instant::now()));
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let message = "specgen has a defect here: it panicked; standard error says where";
                return Err(PyRuntimeError::new_err(message));
            }
        }
        match (py.check_signals(), &raised) {
            (Err(error), None) => {
                stop.store(true, Ordering::SeqCst);
                raised = Some((error, Instant::now()));
            }
            // Pressed once more, or for long enough.
            (Err(error), Some(_)) => return Err(error),
            (Ok(()), Some((_, since))) if since.elapsed() > PATIENCE => {
                return Err(raised.map_or_else(|| PyKeyboardInterrupt::new_err(()), |(error, _)| error));
            }
            (Ok(()), _) => {}
        }
    }
}
