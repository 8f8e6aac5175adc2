//! A device that notes what it was asked to carry out, and frames of requests.

#![allow(dead_code)] // Each test uses its part.

use specgen_link::client::{Client, Port, Timeout};
use specgen_link::{Bytes, CostUnit, Device, Endpoint, Identity, Reply, Request};
use std::io;
use std::time::Duration;

/// Notes requests as text; answers setpoints with `Done`.
#[derive(Default)]
pub struct Notebook {
    pub carried_out: Vec<String>,
}

impl Device for Notebook {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        self.carried_out.push(format!("{request:?}"));
        match request {
            Request::Hello => Reply::Identity(IDENTITY),
            _ => Reply::Done,
        }
    }
}

pub const IDENTITY: Identity = Identity {
    config_words: 55,
    input_words: 35,
    output_words: 57,
    stages: 10,
    counted: CostUnit::Instructions,
    description: 4000,
};

/// Keeps what a client sends and answers nothing.
pub struct Tap<'a>(pub &'a mut Vec<Vec<u8>>, pub &'a mut dyn FnMut(&[u8]) -> Vec<u8>, pub Vec<u8>);

impl Port for Tap<'_> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.push(bytes.to_vec());
        self.2.extend((self.1)(bytes));
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _limit: Duration) -> io::Result<usize> {
        let count = self.2.len().min(buffer.len());
        buffer[..count].copy_from_slice(&self.2[..count]);
        self.2.drain(..count);
        Ok(count)
    }
}

/// What an endpoint answers to these bytes, with its device.
pub fn answered(endpoint: &mut Endpoint, device: &mut dyn Device, bytes: &[u8]) -> Vec<u8> {
    bytes.iter().flat_map(|byte| endpoint.push(*byte, device).unwrap_or_default().to_vec()).collect()
}

/// Words with many zeros and few, as settings and set-points have.
pub fn words(count: usize, seed: u64) -> Vec<u8> {
    (0..count as u64)
        .flat_map(|k| match k % 3 {
            0 => 0_u64.to_le_bytes(),
            1 => (seed + k).to_le_bytes(),
            _ => (0.1 * (seed + k) as f64).to_le_bytes(),
        })
        .collect()
}

/// A session as the client of this crate sends it: the zero, then a frame for each request.
pub fn session(requests: &[Request<'_>]) -> Vec<Vec<u8>> {
    let mut sent = Vec::new();
    let mut endpoint = Endpoint::new();
    let mut device = Notebook::default();
    let mut answer = |bytes: &[u8]| answered(&mut endpoint, &mut device, bytes);
    let (mut client, identity) = Client::open(Tap(&mut sent, &mut answer, Vec::new()), 0x4711, Timeout::PIPE).unwrap();
    assert_eq!(identity, IDENTITY);
    for request in requests {
        assert_eq!(client.ask(request).unwrap(), Reply::Done);
    }
    drop(client);
    sent
}

/// The bytes of some words, to borrow from.
pub fn leaked(count: usize, seed: u64) -> Bytes<'static> {
    Bytes(Box::leak(words(count, seed).into_boxed_slice()))
}
