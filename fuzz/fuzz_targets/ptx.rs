#![no_main]
portolan_fuzz::target!("ptx", portolan_fuzz::readers::ptx);
