#![no_main]
portolan_fuzz::target!("numpy", portolan_fuzz::readers::numpy);
