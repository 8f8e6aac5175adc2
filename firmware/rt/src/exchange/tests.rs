use super::*;

const DIGEST: &str = "00112233445566778899aabbccddeeff00112233445566778899aabbccddeeff";

fn name(test: &str) -> PathBuf {
    path_of(&format!("test-{test}-{}", std::process::id())).unwrap()
}

#[test]
fn a_machine_answers_every_tick_and_catches_up_after_skipped_ones() {
    let path = name("answers");
    let server = Server::create(&path, DIGEST).unwrap();
    let client = Client::open(&path, DIGEST).unwrap();
    let machine = std::thread::spawn(move || {
        // Its gauges read the ticks since the start under the codes that it had.
        let (mut seen, mut session, mut tick) = (0, 0, 0);
        let mut held = [0; 6];
        let mut position = [0; 6];
        while tick < 2_000 {
            let Some((actuation, wanted)) = server.wait(&mut seen, 1_000, 1_000_000_000) else { break };
            if wanted[0] != session {
                (session, tick) = (wanted[0], wanted[1]);
            } else {
                let mut go_on = |tick: &mut u64, to: u64, held: &[i32; 6]| {
                    while *tick < to {
                        (0..6).for_each(|k| position[k] += held[k]);
                        *tick += 1;
                    }
                };
                if actuation.session == session && actuation.tick >= tick {
                    go_on(&mut tick, actuation.tick, &held);
                    held = if actuation.enable { actuation.codes } else { [0; 6] };
                    go_on(&mut tick, actuation.tick + 1, &held);
                }
                go_on(&mut tick, wanted[1], &held);
            }
            server.publish(&Sensing { session, tick, codes: position, wrench: [tick; 6] });
        }
    });
    let mut expected = [0; 6];
    let mut held = [0; 6];
    let (mut tick, mut last) = (0, 0);
    while tick < 2_000 {
        let sensing = client.sense(tick, 1_000_000_000).expect("the machine answers");
        for _ in last..tick {
            (0..6).for_each(|k| expected[k] += held[k]);
        }
        assert_eq!((sensing.tick, sensing.codes, sensing.wrench), (tick, expected, [tick; 6]));
        let enable = tick % 7 != 0;
        let codes = core::array::from_fn(|k| (tick as i32 % 5) - k as i32);
        client.actuate(tick, enable, &codes);
        held = if enable { codes } else { [0; 6] };
        last = tick;
        tick += if tick % 50 == 49 { 9 } else { 1 };
    }
    client.actuate(5_000, false, &[0; 6]);
    machine.join().unwrap();
    assert!(client.is_abandoned());
}

#[test]
fn a_block_is_never_seen_half_written() {
    let path = name("half");
    let server = Server::create(&path, DIGEST).unwrap();
    let client = Client::open(&path, DIGEST).unwrap();
    let writer = std::thread::spawn(move || {
        (1..200_000_u64).for_each(|n| client.actuate(n, true, &[n as i32; 6]));
    });
    let mut seen = 0;
    let mut last = 0;
    let end = clock::now() + 60_000_000_000;
    while last < 199_999 && clock::now() < end {
        // None where the writer lost its processor in the midst of a block; it rings when that is whole.
        let Some((actuation, _)) = server.wait(&mut seen, 0, 2_000_000_000) else { continue };
        assert!(actuation.tick >= last && actuation.codes == [actuation.tick as i32; 6], "{actuation:?}");
        last = actuation.tick;
    }
    writer.join().unwrap();
    assert_eq!(last, 199_999);
}

#[test]
fn a_machine_that_is_silent_or_gone_is_noticed_in_time() {
    let path = name("silent");
    let server = Server::create(&path, DIGEST).unwrap();
    let client = Client::open(&path, DIGEST).unwrap();
    let start = clock::now();
    assert_eq!(client.sense(0, 3_000_000), None);
    assert!(clock::now() - start >= 3_000_000);
    assert!(!client.is_abandoned());
    drop(server);
    assert!(client.is_abandoned() && !path.exists());
}

#[test]
fn what_cannot_be_opened_says_what_to_do() {
    let path = name("refused");
    let refusal = |path: &Path, digest: &str| Client::open(path, digest).map(|_| ()).unwrap_err().to_string();
    assert!(refusal(&path, DIGEST).contains("start one with `specgen plant SPEC`"));
    let server = Server::create(&path, DIGEST).unwrap();
    assert!(refusal(&path, &DIGEST.replace("00112233", "00112234")).contains("the machine of another spec"));
    let again = Server::create(&path, DIGEST).map(|_| ()).unwrap_err().to_string();
    assert!(again.contains(&format!("process {} serves", std::process::id())), "{again}");
    drop(server);
    put(&path, b"short", 0o600);
    assert!(refusal(&path, DIGEST).contains("not a simulated machine"));
    put(&path, &[0; size_of::<SharedWords>()], 0o600);
    assert!(refusal(&path, DIGEST).contains("not a simulated machine"));
    // Remains of a killed machine are replaced.
    drop(Server::create(&path, DIGEST).unwrap());
    assert!(path_of("../x").unwrap_err().contains("letters, digits"));
}

fn put(path: &Path, bytes: &[u8], mode: u32) {
    std::fs::write(path, bytes).unwrap();
    std::fs::set_permissions(path, std::os::unix::fs::PermissionsExt::from_mode(mode)).unwrap();
}

/// The machine at `path` is not made, because `place` is what `why` says; nor found, if that is its own place.
fn refused(path: &Path, place: &Path, why: &str) {
    let made = Server::create(path, DIGEST).map(|_| ());
    let found = (place == path).then(|| Client::open(path, DIGEST).map(|_| ()));
    for said in [Some(made), found].into_iter().flatten() {
        let text = said.unwrap_err().to_string();
        assert!(text.starts_with(&format!("{}: {why}", place.display())), "{text}");
        assert!(text.ends_with("remove it, or choose another --name"), "{text}");
    }
}

#[test]
fn a_link_that_somebody_planted_is_not_followed() {
    let path = name("link");
    let victim = name("victim");
    let precious = [7; size_of::<SharedWords>()];
    let part = path.with_extension(format!("{}.part", std::process::id()));
    for place in [&part, &path] {
        put(&victim, &precious, 0o600);
        std::os::unix::fs::symlink(&victim, place).unwrap();
        refused(&path, place, &format!("it is a symbolic link to {}", victim.display()));
        assert!(place.is_symlink());
        assert_eq!(std::fs::read(&victim).unwrap(), precious);
        std::fs::remove_file(place).unwrap();
    }
    std::fs::remove_file(victim).unwrap();
    drop(Server::create(&path, DIGEST).unwrap());
}

#[test]
fn a_file_that_others_may_write_or_own_is_refused() {
    use std::os::unix::fs::{MetadataExt, chown};
    let path = name("others");
    put(&path, &[0; size_of::<SharedWords>()], 0o666);
    refused(&path, &path, "its mode is 666, expected 600");
    put(&path, &[0; size_of::<SharedWords>()], 0o600);
    let owner = std::fs::metadata(&path).unwrap().uid();
    match chown(&path, Some(owner + 1), None) {
        Ok(()) => refused(&path, &path, &format!("it belongs to user {}, and this is user {owner}", owner + 1)),
        Err(error) => println!("skipped 1: a test: a file of another user: {error}"),
    }
    std::fs::remove_file(&path).unwrap();
    std::fs::create_dir(&path).unwrap();
    assert!(Server::create(&path, DIGEST).is_err() && Client::open(&path, DIGEST).is_err());
    std::fs::remove_dir(&path).unwrap();
}

/// A file shorter than its mapping would end the process that reads it.
#[test]
fn a_file_that_is_mapped_is_never_made_shorter() {
    let path = name("mapped");
    let part = path.with_extension(format!("{}.part", std::process::id()));
    for (place, removed) in [(&part, true), (&path, false)] {
        let left = Mapping::<SharedWords>::create(place).unwrap();
        let kept = std::fs::File::open(place).unwrap();
        left.words().version.store(42, Ordering::Relaxed);
        let server = Server::create(&path, DIGEST).unwrap();
        assert_eq!(kept.metadata().unwrap().len(), size_of::<SharedWords>() as u64);
        assert_eq!(left.words().version.load(Ordering::Relaxed), 42, "the old one is as it was");
        assert_eq!(place.exists(), !removed);
        drop(server);
    }
}

#[test]
fn a_file_that_becomes_shorter_ends_no_process() {
    let path = name("shorter");
    let server = Server::create(&path, DIGEST).unwrap();
    let client = Client::open(&path, DIGEST).unwrap();
    server.publish(&Sensing { session: client.session, tick: 1, codes: [7; 6], wrench: [0; 6] });
    assert_eq!(client.sense(1, 1_000_000).map(|sensing| sensing.codes), Some([7; 6]));
    assert!(!server.is_lost() && !client.is_abandoned());
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(0).unwrap();
    // Nothing answers any more.
    assert!(client.sense(2, 1_000_000).is_none() && client.is_abandoned());
    client.actuate(2, true, &[1; 6]);
    assert!(server.wait(&mut 0, 0, 1_000_000).is_none() && server.is_lost());
    // And the next machine is another one.
    drop(server);
    let server = Server::create(&path, DIGEST).unwrap();
    assert!(!server.is_lost() && Client::open(&path, DIGEST).is_ok());
}
