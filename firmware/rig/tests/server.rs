//! The loop on a board that is a test's.

use furuta_ctrl::supervisor::{Mode, Request};
use furuta_wire::{
    ArmCounts, Command, Decoder, Hello, MAX_FRAME, Message, PROTOCOL_VERSION, PendulumCounts,
    Query, Sample, Status, encode,
};
use rig::{Board, Clock, EmulatedMechanics, HostLed, OnChip, Pilot, Server, the_rig};

fn the_rig() -> the_rig::TheRig {
    the_rig::TheRig::new().expect("its effects are possible")
}

const PERIOD: u64 = the_rig::PERIOD_US as u64;

/// Time passes when the loop idles: 50 us.
struct Bench<const EMULATED: bool> {
    now_us: u64,
    volts: Vec<f32>,
    to_rig: Vec<u8>,
    from_rig: Vec<u8>,
    /// Bytes that the line takes.
    capacity: usize,
    mechanics: EmulatedMechanics,
}

impl<const EMULATED: bool> Bench<EMULATED> {
    fn new() -> Self {
        Self {
            now_us: 7,
            volts: Vec::new(),
            to_rig: Vec::new(),
            from_rig: Vec::new(),
            capacity: usize::MAX,
            mechanics: the_rig().mechanics().expect("a rig"),
        }
    }

    fn hear(&mut self) -> Vec<Message> {
        let mut decoder = Decoder::new();
        let bytes = std::mem::take(&mut self.from_rig);
        let messages = bytes.iter().filter_map(|&byte| decoder.push(byte));
        messages.map(|m| m.expect("a frame")).collect()
    }

    fn say(&mut self, message: &Message) {
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(message, &mut buffer).expect("fits");
        self.to_rig.extend_from_slice(frame);
    }

    fn command(&mut self, seq: u32, volts: f32) {
        self.say(&Message::Command(Command { seq, volts }));
    }
}

impl<const EMULATED: bool> Board for Bench<EMULATED> {
    const CLOCK: Clock = if EMULATED {
        Clock::Emulated
    } else {
        Clock::Real
    };

    fn now_us(&mut self) -> u64 {
        self.now_us
    }

    fn counts(&mut self) -> (ArmCounts, PendulumCounts) {
        self.mechanics.counts()
    }

    fn drive(&mut self, volts: f32) {
        self.volts.push(volts);
        self.mechanics.advance(volts);
    }

    fn read(&mut self) -> Option<u8> {
        (!self.to_rig.is_empty()).then(|| self.to_rig.remove(0))
    }

    fn write(&mut self, byte: u8) -> bool {
        let free = self.capacity > 0;
        if free {
            self.capacity -= 1;
            self.from_rig.push(byte);
        }
        free
    }

    fn idle(&mut self) {
        self.now_us += 50;
    }
}

type OnBench<P, const EMULATED: bool> = Server<Bench<EMULATED>, P>;

fn host_led<const EMULATED: bool>() -> OnBench<HostLed, EMULATED> {
    Server::new(Bench::new(), HostLed, the_rig::hello())
}

/// Polls until a tick.
fn next<P: Pilot, const EMULATED: bool>(server: &mut OnBench<P, EMULATED>) -> Sample {
    (0..100_000).find_map(|_| server.poll()).expect("it ticks")
}

#[test]
fn at_power_on_the_motor_is_off() {
    let mut server = host_led::<false>();
    assert_eq!(server.board().volts, [0.0]);
    let sample = next(&mut server);
    assert_eq!((sample.seq, sample.volts), (0, 0.0));
    assert!(sample.status.contains(Status::WATCHDOG));
}

#[test]
fn a_query_is_answered_between_samples() {
    let mut server = host_led::<false>();
    next(&mut server);
    server.board().hear();
    let version = PROTOCOL_VERSION;
    server.board().say(&Message::Query(Query { version }));
    server.poll();
    let expected: Hello = the_rig::hello();
    assert_eq!(server.board().hear(), [Message::Hello(expected)]);
    assert_eq!(expected.rig.as_str(), the_rig::NAME);
}

/// The deadline is the one announced, on the clock of the rig.
#[test]
fn the_motor_is_off_when_commands_stop() {
    let mut server = host_led::<false>();
    let mut sample = next(&mut server);
    for _ in 0..20 {
        server.board().command(sample.seq, 2.0);
        sample = next(&mut server);
        assert_eq!((sample.volts, sample.status), (2.0, Status::OK));
    }
    let last = sample.t_us;
    while sample.volts != 0.0 {
        assert_eq!(server.board().volts.last(), Some(&2.0));
        sample = next(&mut server);
    }
    assert_eq!(server.board().volts.last(), Some(&0.0));
    let deadline = u64::from(the_rig::hello().watchdog_periods) * PERIOD;
    let took = sample.t_us - last;
    assert!(
        deadline <= 20_000 && took.abs_diff(deadline) <= 50,
        "{took}"
    );
}

/// A host that answers late is waited for by emulated mechanics, and not by real ones.
#[test]
fn only_emulated_time_stands_still() {
    fn late_host<const EMULATED: bool>() -> (u64, Status) {
        let mut server = host_led::<EMULATED>();
        let mut sample = next(&mut server);
        for _ in 0..5 {
            server.board().command(sample.seq, 1.0);
            sample = next(&mut server);
        }
        let before = server.board().now_us;
        // The answer comes after three periods.
        while server.board().now_us < before + 3 * PERIOD {
            if let Some(next) = server.poll() {
                sample = next;
            }
        }
        server.board().command(sample.seq, 1.0);
        let sample = next(&mut server);
        (sample.t_us, sample.status)
    }
    assert_eq!(late_host::<true>(), (6 * PERIOD, Status::OK));
    let (t_us, status) = late_host::<false>();
    assert!(t_us >= 8 * PERIOD, "{t_us}");
    assert_eq!(status, Status::OK);
}

/// A patient rig, too, switches the motor off when its host is gone.
#[test]
fn a_silent_host_meets_the_watchdog_of_emulated_mechanics() {
    let mut server = host_led::<true>();
    let mut sample = next(&mut server);
    for _ in 0..5 {
        server.board().command(sample.seq, 1.0);
        sample = next(&mut server);
    }
    let before = server.board().now_us;
    while sample.volts != 0.0 {
        sample = next(&mut server);
    }
    assert!(server.board().now_us - before < 200_000 + 12 * PERIOD);
}

/// After a halt the ticks go on at their period instead of catching up.
#[test]
fn a_halted_clock_is_not_made_up_for() {
    let mut server = host_led::<false>();
    next(&mut server);
    server.board().now_us += 1_000_000;
    let first = next(&mut server).t_us;
    let second = next(&mut server).t_us;
    assert!((second - first).abs_diff(PERIOD) <= 50, "{first} {second}");
}

/// A line without a reader holds nothing up, and loses whole frames.
#[test]
fn a_stuck_line_loses_whole_samples() {
    let mut server = host_led::<false>();
    server.board().capacity = 0;
    for _ in 0..100 {
        next(&mut server);
    }
    assert!(server.board().hear().is_empty());
    server.board().capacity = usize::MAX;
    next(&mut server);
    next(&mut server);
    let mut seqs = Vec::new();
    for message in server.board().hear() {
        match message {
            Message::Sample(sample) => seqs.push(sample.seq),
            other => panic!("{other:?}"),
        }
    }
    // What was in the outbox, whole; then what comes now.
    assert!(seqs.len() > 5 && seqs.ends_with(&[100, 101]), "{seqs:?}");
    assert!(seqs.windows(2).all(|w| w[0] < w[1]), "{seqs:?}");
}

#[test]
fn the_loop_on_the_chip_swings_up_and_balances_and_obeys_no_host() {
    let supervisor = the_rig().supervisor().expect("a rig");
    let hello = the_rig::hello();
    let pilot = OnChip::new(supervisor, &hello);
    let mut server = Server::new(Bench::<false>::new(), pilot, hello);
    for _ in 0..50 {
        assert_eq!(next(&mut server).volts, 0.0); // idle
    }
    assert!(server.pilot().request(Request::Start));
    let mut upright = 0;
    for _ in 0..5000 {
        let sample = next(&mut server);
        server.board().command(sample.seq, 9.0); // is overruled
        if server.pilot().mode() == Mode::Balance {
            let state = server.board().mechanics.state();
            upright += u32::from(furuta_ctrl::wrap(state.alpha).abs() < 0.1);
        }
    }
    assert!(upright > 4000, "{upright}");
    assert!(server.pilot().request(Request::Stop));
    next(&mut server);
    assert_eq!(next(&mut server).volts, 0.0);
}
