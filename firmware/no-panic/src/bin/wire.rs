//! The rig's end of the wire: bytes in, ticks, bytes out.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
use {
    furuta_wire::{ArmCounts, PendulumCounts},
    furuta_wire::{Message, RigEnd, encode},
    no_panic::any,
};

no_panic::step!({
    let end = any::<RigEnd>();
    end.receive(*any());
    let sample = end.tick(*any(), *any::<ArmCounts>(), *any::<PendulumCounts>());
    let _ = encode(&Message::Sample(sample), any::<[u8; 64]>());
    end.hello()
        .map(|hello| encode(&Message::Hello(hello), any::<[u8; 96]>()).is_ok())
});
