#![no_main]
portolan_fuzz::target!("e57", portolan_fuzz::readers::e57);
