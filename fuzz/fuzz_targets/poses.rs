#![no_main]
portolan_fuzz::target!("poses", portolan_fuzz::readers::poses);
