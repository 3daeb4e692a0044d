//! A deterministic mutation tester: it changes seed texts at random and looks for panics and hangs.
//!
//! The same seed and corpus give the same inputs on every machine. The number of inputs is 20 000 in the tests;
//! `VEDUTA_FUZZ=1000000 cargo test --release -p veduta-compose fuzz` runs as many as it says.

use std::fmt;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The environment variable with the number of inputs.
pub const COUNT_VARIABLE: &str = "VEDUTA_FUZZ";

/// The number of inputs: that of `VEDUTA_FUZZ`, otherwise `default`.
///
/// # Errors
/// The variable is set, but no whole number.
pub fn count(default: usize) -> Result<usize, String> {
    match std::env::var(COUNT_VARIABLE) {
        Err(std::env::VarError::NotPresent) => Ok(default),
        Ok(text) => text
            .trim()
            .parse()
            .map_err(|_| format!("{COUNT_VARIABLE}={text}: a whole number is expected")),
        Err(error) => Err(format!("{COUNT_VARIABLE}: {error}")),
    }
}

/// The generator PCG32 (XSH RR 64/32) of O'Neill 2014.
#[derive(Clone, Debug)]
pub struct Pcg {
    state: u64,
}

impl Pcg {
    const MULTIPLIER: u64 = 6364136223846793005;
    /// Stream 54, as in the demonstration of the reference implementation.
    const INCREMENT: u64 = 54 << 1 | 1;

    /// A generator; different seeds give different sequences.
    pub fn new(seed: u64) -> Self {
        let mut rng = Self { state: 0 };
        rng.next_u32();
        rng.state = rng.state.wrapping_add(seed);
        rng.next_u32();
        rng
    }

    /// 32 random bits.
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old
            .wrapping_mul(Self::MULTIPLIER)
            .wrapping_add(Self::INCREMENT);
        let shifted = (((old >> 18) ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// A whole number from 0 to `end - 1`; 0 if `end` is 0. The bias is below 2^-32 times `end`.
    pub fn below(&mut self, end: usize) -> usize {
        ((u64::from(self.next_u32()) * end as u64) >> 32) as usize
    }
}

/// Longer inputs are cut.
const LONGEST: usize = 1 << 16;

/// Characters that text tools trip over: a mark, a joiner, line separators, wide and combining ones, controls.
const ODD: [&str; 16] = [
    "\u{feff}", "\u{200d}", "\u{2028}", "\u{85}", "\u{200e}", "é", "e\u{301}", "中", "🦀", "\r\n",
    "\r", "\0", "\u{7f}", "\u{202e}", "\t", "\u{a0}",
];

/// Makes inputs out of seed texts.
#[derive(Clone, Debug)]
pub struct Mutator {
    rng: Pcg,
    corpus: Vec<Vec<u8>>,
    tokens: Vec<Vec<u8>>,
}

impl Mutator {
    /// A source of inputs; `tokens` are pieces of the format's syntax that are put in.
    pub fn new(seed: u64, corpus: &[&str], tokens: &[&str]) -> Self {
        let bytes = |texts: &[&str]| texts.iter().map(|text| text.as_bytes().to_vec()).collect();
        Self {
            rng: Pcg::new(seed),
            corpus: bytes(corpus),
            tokens: bytes(tokens),
        }
    }

    /// A seed text after one to eight changes; not always UTF-8.
    pub fn next_input(&mut self) -> Vec<u8> {
        let mut input = self.seed_text();
        for _ in 0..=self.rng.below(8) {
            self.change(&mut input);
            input.truncate(LONGEST);
        }
        input
    }

    /// The next input as text: what is not UTF-8 is replaced.
    pub fn next_text(&mut self) -> String {
        String::from_utf8_lossy(&self.next_input()).into_owned()
    }

    fn seed_text(&mut self) -> Vec<u8> {
        let index = self.rng.below(self.corpus.len());
        self.corpus.get(index).cloned().unwrap_or_default()
    }

    /// A place in the input.
    fn place(&mut self, input: &[u8]) -> usize {
        self.rng.below(input.len() + 1)
    }

    /// A range of the input, mostly short.
    fn range(&mut self, input: &[u8]) -> Range<usize> {
        let from = self.place(input);
        let longest = match self.rng.below(4) {
            0 => 1,
            1 => 8,
            2 => 64,
            _ => input.len(),
        };
        let length = 1 + self.rng.below(longest);
        from..(from + length).min(input.len())
    }

    /// A word or a run of other characters around a place.
    fn token(&mut self, input: &[u8]) -> Range<usize> {
        let at = self.place(input);
        let is_word = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
        let Some(&kind) = input.get(at) else {
            return at..at;
        };
        let same = |byte: &u8| is_word(*byte) == is_word(kind);
        let before = input[..at].iter().rev().take_while(|b| same(b)).count();
        let after = input[at..].iter().take_while(|b| same(b)).count();
        at - before..at + after
    }

    fn change(&mut self, input: &mut Vec<u8>) {
        match self.rng.below(14) {
            // Delete.
            0 => {
                let range = self.range(input);
                input.drain(range);
            }
            // Delete a token.
            1 => {
                let range = self.token(input);
                input.drain(range);
            }
            // Replace a byte.
            2 => {
                let at = self.place(input);
                let byte = self.rng.next_u32() as u8;
                if let Some(old) = input.get_mut(at) {
                    *old = byte;
                }
            }
            // Insert a byte of the ASCII range.
            3 => {
                let at = self.place(input);
                input.insert(at, (self.rng.next_u32() & 0x7f) as u8);
            }
            // Insert a piece of syntax.
            4 | 5 => {
                let at = self.place(input);
                let index = self.rng.below(self.tokens.len());
                if let Some(token) = self.tokens.get(index) {
                    input.splice(at..at, token.iter().copied());
                }
            }
            // Replace a token by a piece of syntax.
            6 => {
                let range = self.token(input);
                let index = self.rng.below(self.tokens.len());
                if let Some(token) = self.tokens.get(index) {
                    input.splice(range, token.iter().copied());
                }
            }
            // Swap two tokens.
            7 => {
                let (a, b) = (self.token(input), self.token(input));
                let (a, b) = if a.start <= b.start { (a, b) } else { (b, a) };
                if a.end <= b.start {
                    let second = input[b.clone()].to_vec();
                    let first = input[a.clone()].to_vec();
                    input.splice(b, first);
                    input.splice(a, second);
                }
            }
            // Duplicate a range elsewhere.
            8 => {
                let range = self.range(input);
                let piece = input[range].to_vec();
                let at = self.place(input);
                input.splice(at..at, piece);
            }
            // Repeat a short range many times.
            9 => {
                let range = self.token(input);
                let piece = input[range.start..range.end.min(range.start + 16)].to_vec();
                let times = 1 << self.rng.below(10);
                let at = range.start;
                input.splice(at..at, piece.repeat(times));
            }
            // Cut off the end.
            10 => {
                let at = self.place(input);
                input.truncate(at);
            }
            // Go on with another seed.
            11 => {
                let other = self.seed_text();
                let (at, from) = (self.place(input), self.place(&other));
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
            // Insert an odd character.
            12 => {
                let at = self.place(input);
                let odd = ODD[self.rng.below(ODD.len())];
                input.splice(at..at, odd.bytes());
            }
            // Nest.
            _ => {
                let at = self.place(input);
                let open = *b"([{#/<".get(self.rng.below(6)).unwrap_or(&b'(');
                let times = 1 << self.rng.below(9);
                input.splice(at..at, std::iter::repeat_n(open, times));
            }
        }
    }
}

/// What a run found.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Report {
    /// Inputs tried.
    pub inputs: usize,
    /// Inputs for which the check returned true.
    pub accepted: usize,
    /// The longest time of one input.
    pub slowest: Duration,
}

/// An input that must not be.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Failure {
    /// What happened.
    pub what: String,
    /// Its number, from 0.
    pub index: usize,
    /// The input.
    pub input: Vec<u8>,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "input {}: {}\n{}",
            self.index,
            self.what,
            self.input.escape_ascii()
        )
    }
}

impl std::error::Error for Failure {}

/// Gives `count` inputs to `check`, which returns whether it accepted one, and panics if it finds a fault of the reader.
///
/// # Errors
/// The first input on which `check` panics, or on which it takes longer than `limit` (it is then left running).
pub fn run(
    count: usize,
    mut mutator: Mutator,
    limit: Duration,
    mut check: impl FnMut(&[u8]) -> bool + Send + 'static,
) -> Result<Report, Failure> {
    let current: Arc<Mutex<(usize, Vec<u8>)>> = Arc::default();
    let shared = Arc::clone(&current);
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let mut report = Report {
            inputs: 0,
            accepted: 0,
            slowest: Duration::ZERO,
        };
        for index in 0..count {
            let input = mutator.next_input();
            *shared.lock().unwrap_or_else(PoisonError::into_inner) = (index, input.clone());
            let start = Instant::now();
            let outcome = catch_unwind(AssertUnwindSafe(|| check(&input)));
            report.slowest = report.slowest.max(start.elapsed());
            match outcome {
                Ok(accepted) => report.accepted += usize::from(accepted),
                Err(panic) => {
                    let what = panic
                        .downcast_ref::<String>()
                        .cloned()
                        .or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()))
                        .unwrap_or_default();
                    let failure = Failure {
                        what: format!("panic: {what}"),
                        index,
                        input,
                    };
                    // Nobody listens any more only if the run was given up.
                    let _ = sender.send(Some(Err(failure)));
                    return;
                }
            }
            report.inputs += 1;
            if sender.send(None).is_err() {
                return;
            }
        }
        let _ = sender.send(Some(Ok(report)));
    });
    loop {
        match receiver.recv_timeout(limit) {
            Ok(None) => {}
            Ok(Some(result)) => return result,
            Err(error) => {
                let (index, input) = current
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .clone();
                let what = match error {
                    RecvTimeoutError::Timeout => format!("no end after {limit:?}"),
                    RecvTimeoutError::Disconnected => "the thread of the run ended".to_owned(),
                };
                return Err(Failure { what, index, input });
            }
        }
    }
}
