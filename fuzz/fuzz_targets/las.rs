#![no_main]
portolan_fuzz::target!("las", portolan_fuzz::readers::las);
