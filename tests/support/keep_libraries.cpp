// LeakSanitizer can name the library of a leak, and so suppress it, only while that library is mapped; libEGL unloads
// Mesa's driver before the process ends. Linked into sanitized tests that draw: nothing is unloaded.
extern "C" int dlclose(void* /*library*/) { return 0; }
