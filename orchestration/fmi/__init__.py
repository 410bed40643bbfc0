"""FMUs of FMI 2.0: archives, instances, slaves behind the protocol of cosim.subsystem, units."""
