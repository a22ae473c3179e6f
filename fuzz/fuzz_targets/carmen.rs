#![no_main]
portolan_fuzz::target!("carmen", portolan_fuzz::readers::carmen);
