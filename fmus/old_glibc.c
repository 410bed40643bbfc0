// Lets an FMU linked on a newer Linux load where glibc is 2.17 or newer: what the static C++ library and the linker
// would ask of later releases is answered here, or by the versions of 2.2.5, which every glibc for x86-64 has.
//
// Each name below came, or changed, after 2.17: exp and its like with 2.29, hypot with 2.35, pthread_once moved to libc
// with 2.34, __libc_single_threaded came with 2.32, _dl_find_object, which libgcc's unwinder asks, with 2.35.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <link.h>
#include <stddef.h>

#define FROM_2_2_5(name) __asm__(".symver old_" #name ", " #name "@GLIBC_2.2.5")
#define FUNCTION(name)       \
  double old_##name(double); \
  FROM_2_2_5(name);          \
  double name(double x) { return old_##name(x); }
#define FUNCTION_OF_TWO(name)        \
  double old_##name(double, double); \
  FROM_2_2_5(name);                  \
  double name(double x, double y) { return old_##name(x, y); }

FUNCTION(exp)
FUNCTION(exp2)
FUNCTION(log)
FUNCTION(log2)
FUNCTION_OF_TWO(hypot)
FUNCTION_OF_TWO(pow)

int old_pthread_once(int* control, void (*routine)(void));
FROM_2_2_5(pthread_once);
int pthread_once(int* control, void (*routine)(void)) { return old_pthread_once(control, routine); }

int old_key_create(unsigned* key, void (*destructor)(void*));
__asm__(".symver old_key_create, __pthread_key_create@GLIBC_2.2.5");
int __pthread_key_create(unsigned* key, void (*destructor)(void*)) { return old_key_create(key, destructor); }

char __libc_single_threaded = 0;  // threads may run: reference counts are atomic

#ifdef DLFO_STRUCT_HAS_EH_DBASE

struct search {
  ElfW(Addr) wanted;
  struct dl_find_object* result;
};

static int examine(struct dl_phdr_info* object, size_t size, void* argument) {
  (void)size;
  struct search* search = argument;
  int is_here = 0;
  search->result->dlfo_eh_frame = NULL;
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    const ElfW(Phdr)* segment = &object->dlpi_phdr[i];
    const ElfW(Addr) start = object->dlpi_addr + segment->p_vaddr;
    if (segment->p_type == PT_LOAD && search->wanted - start < segment->p_memsz) {
      is_here = 1;
      search->result->dlfo_map_start = (void*)start;
      search->result->dlfo_map_end = (void*)(start + segment->p_memsz);
    }
    if (segment->p_type == PT_GNU_EH_FRAME) search->result->dlfo_eh_frame = (void*)start;
  }
  return is_here;  // other than 0 ends the search
}

/// The loaded object that has an address, and its table for unwinding; 0 when there is one.
int _dl_find_object(void* address, struct dl_find_object* result) {
  *result = (struct dl_find_object){0};
  struct search search = {(ElfW(Addr))address, result};
  return dl_iterate_phdr(examine, &search) && result->dlfo_eh_frame ? 0 : -1;
}

#endif
