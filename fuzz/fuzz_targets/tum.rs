#![no_main]
portolan_fuzz::target!("tum", portolan_fuzz::readers::tum);
