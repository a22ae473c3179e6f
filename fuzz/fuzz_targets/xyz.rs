#![no_main]
portolan_fuzz::target!("xyz", portolan_fuzz::readers::xyz);
