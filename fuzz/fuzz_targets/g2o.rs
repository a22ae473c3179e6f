#![no_main]
portolan_fuzz::target!("g2o", portolan_fuzz::readers::g2o);
