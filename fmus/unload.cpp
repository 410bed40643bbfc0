// Frees what the C++ library inside an FMU's binary keeps for itself: 70 kB that would leak with every dlclose.
//
// The standard library is linked statically, so its emergency pool for exceptions is the binary's own; libstdc++ has a
// function to free it that only memory checkers would call otherwise. Linked into FMUs only, never into programs.
#include <cstddef>

#ifdef __GLIBCXX__
namespace __gnu_cxx {
void __freeres();
}

__attribute__((destructor)) static void free_exception_pool() { __gnu_cxx::__freeres(); }
#endif
